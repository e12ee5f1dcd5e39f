"""Why the machine never became active in a session, as far as the session knows."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.modes import STARTING, Mode
from ..core.sections import Config
from ..recording.summary import Report
from .outcome import Outcome

NOTICED_S = 0.1
"""A session that ends this soon after a press may end before the press shows [s]."""


@dataclass(frozen=True, slots=True)
class NeverActive:
    """A session without a tick in which the machine rendered with all of the hand's force.

    Attributes:
        why: for people.
        excused: whether nothing else could be expected: its end was asked for, or it was so short.
    """

    why: str
    excused: bool

    def __str__(self) -> str:
        return f"the machine never became active: {self.why}"


def never_active(config: Config, outcome: Outcome) -> NeverActive | None:
    """Why the machine never became active; None where it did, or nobody knows."""
    report = outcome.report
    if report is None or Mode.ACTIVE.name in report.modes:
        return None
    short = _short(config, report)
    if short and not (outcome.refused or report.stop):
        return NeverActive(short, excused=True)
    return NeverActive(_hindrance(report, outcome.refused), outcome.asked)


def _hindrance(report: Report, refused: str) -> str:
    if report.stop:
        return f"it was stopped: {report.stop}"
    if refused:
        return f"not started: {refused}"
    if Mode.READY.name not in report.modes:
        return "its devices did not come up"
    return "nobody pressed the dead-man switch after its devices had come up; press it during the session"


def _short(config: Config, report: Report) -> str:
    """What the session was too short for; "" where it was not."""
    if any(mode.name in report.modes for mode in STARTING):
        return "the session ended before it had engaged"
    lasted, press = (report.ticks + report.shed) / report.rate_hz, first_press(config)
    if press is not None and lasted < press + NOTICED_S:
        return f"the session ended before the simulated hand pressed the dead-man switch, at {press:g} s"
    return ""


def first_press(config: Config) -> float | None:
    """When the script has pressed every dead-man switch that it is to press [s]; None where it never has."""
    simulation = config.simulation
    if simulation is None:
        return None
    scripts = [script for script in (simulation.hand.dead_man, simulation.supervisor) if script is not None]
    firsts = [min((float(each.at) for each in script if each.pressed), default=None) for script in scripts]
    known = [at for at in firsts if at is not None]
    return max(known) if len(known) == len(firsts) else None
