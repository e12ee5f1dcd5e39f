"""How a session ended: exit status and reason, live and in lockstep."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from signal import Signals

from ...safety import describe
from ..core.cycle import Cycle
from ..core.modes import Mode
from ..recording.summary import Report
from .interrupts import WORDS, exit_status

END_LIMIT_S = 2.0
"""How long the machine may take to come to rest at the end of a session."""
DRIVES_STOP = "the watchdogs of the drives stop the machine"


@dataclass(slots=True)
class Outcome:
    """How a session ended.

    Attributes:
        report: its summary, None where there is none.
        status: exit status of the program.
        message: why, for people.
        speed_x: how many times faster than real time a lockstep session ran; None where it was live.
        signals: that asked for its end.
        quit: whether a person asked for it by a key or a word.
        refused: why the last press of the dead-man switch started nothing; "" where it did.
    """

    report: Report | None
    status: int
    message: str
    speed_x: float | None = None
    signals: tuple[int, ...] = ()
    quit: bool = False
    refused: str = ""

    @property
    def asked(self) -> bool:
        """Whether somebody asked for its end."""
        return self.quit or bool(self.signals)


@dataclass(slots=True)
class Ending:
    """What a session's end has to do with besides the machine.

    Attributes:
        moved: whether drives ever had power.
        quit: whether a person asked for the end by a key or a word.
        signals: that asked for the end, in their order.
        lost: the bus is gone: how that is known.
        failed: what broke in the program's own surroundings: the simulated plant, the log.
        failed_at: tick of that; a stop from then on is its consequence.
        unrecorded: why there is no summary, where there is none.
    """

    moved: bool = False
    quit: bool = False
    signals: tuple[int, ...] = ()
    lost: str = ""
    failed: str = ""
    failed_at: float = inf
    unrecorded: str = "the recorder was lost; there is no summary"


def outcome(cycle: Cycle, report: Report | None, ending: Ending, speed_x: float | None = None) -> Outcome:
    """What became of a session that is over."""
    status, message = _judge(cycle, report, ending)
    return Outcome(report, status, message, speed_x, ending.signals, ending.quit, cycle.start.refused)


def called_off(number: int) -> Outcome:
    """A session that a signal ended before it began."""
    word = WORDS[Signals(number)]
    return Outcome(
        None, exit_status(number), f"{word} before anything moved; there is no log", None, (number,)
    )


def _judge(cycle: Cycle, report: Report | None, ending: Ending) -> tuple[int, str]:
    mode, signals = cycle.mode, ending.signals
    word = WORDS[Signals(signals[0])] if signals else ""
    if mode is Mode.FAILED:
        return 1, f"the devices did not come up: {cycle.bring_up.failure}"
    if mode.powered and len(signals) > 1:
        again = f"{word}, and again: ended before the machine was at rest"
        return exit_status(signals[1]), f"{again}; {DRIVES_STOP}"
    if cycle.stops.last and cycle.stops.last.tick < ending.failed_at:
        stopped = f"stopped by safety: {describe(cycle.stops.last)}"
        return 3, "; ".join(filter(None, (stopped, ending.failed)))
    if ending.failed:
        return 1, ending.failed
    if mode.powered:
        return 3, f"not at rest within {END_LIMIT_S:g} s; {DRIVES_STOP}"
    if ending.lost:
        return 3, ending.lost
    if not cycle.drives.secured:
        return 3, f"not known to be off: {cycle.drives.power.live}; {DRIVES_STOP}"
    if signals and not ending.moved:
        return exit_status(signals[0]), f"{word} before anything moved"
    if mode is Mode.BRINGUP and ending.quit:
        return 0, "quit before the devices had come up"
    if mode is Mode.BRINGUP:
        return 1, "the devices had not come up when the session ended; let it last longer"
    if report is None:
        return exit_status(signals[1]) if len(signals) > 1 else 1, ending.unrecorded
    return 0, f"{word}; the machine came to rest before the session ended" if signals else ""
