"""How a session ended: exit status and reason, live and in lockstep."""

from __future__ import annotations

from dataclasses import dataclass

from ..safety import describe
from .cycle import Memory
from .modes import Mode
from .summary import Report

END_LIMIT_S = 2.0
"""How long the machine may take to come to rest at the end of a session."""


@dataclass(slots=True)
class Outcome:
    """How a session ended.

    Attributes:
        report: its summary, None where the recorder was lost.
        status: exit status of the program.
        message: why, for people.
        speed_x: how many times faster than real time a lockstep session ran; None where it was live.
    """

    report: Report | None
    status: int
    message: str
    speed_x: float | None = None


def outcome(memory: Memory, report: Report | None, speed_x: float | None = None, lost: str = "") -> Outcome:
    """What became of a session that is over; ``lost`` says whether the bus is gone."""
    if memory.mode is Mode.FAILED:
        return Outcome(report, 1, f"the devices did not come up: {memory.failure}", speed_x)
    if memory.stopped_by:
        return Outcome(report, 3, f"stopped by safety: {describe(memory.stopped_by)}", speed_x)
    if memory.mode.powered:
        why = f"not at rest within {END_LIMIT_S:g} s; the watchdogs of the drives take over"
        return Outcome(report, 3, why, speed_x)
    if lost:
        return Outcome(report, 3, lost, speed_x)
    if not memory.secured:
        why = f"not known to be off: {memory.power.live}; the watchdogs of the drives take over"
        return Outcome(report, 3, why, speed_x)
    if report is None:
        return Outcome(None, 1, "the recorder was lost; there is no summary", speed_x)
    return Outcome(report, 0, "", speed_x)
