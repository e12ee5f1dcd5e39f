"""Whether a session showed what its simulation promises, and whether this host kept up."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

from ..configuration.config import Loaded
from ..core.machine import near
from ..core.modes import RENDERING, Mode
from ..core.sections import SimulatedBus
from ..invocation import program
from ..recording.summary import LimitReport, Report
from .never_active import NeverActive

MOVED = frozenset(mode.name for mode in (*RENDERING, Mode.STOPPING, Mode.HOLDING))
"""Modes of a machine that was started."""
KEPT_UP = 0.01
"""Share of skipped ticks up to which a host keeps up."""


def verdict(
    loaded: Loaded, report: Report, lockstep: bool, idle: NeverActive | None = None
) -> tuple[bool, str]:
    """What a session came to; whether it showed all that was promised, as far as it could, and the line.

    Args:
        loaded: the machine; ``[simulation.touches]`` names the limits that the hand meets on its path.
        report: the summary.
        lockstep: whether time was virtual: then no host has to keep up.
        idle: why the machine never became active, where it did not.
    """
    said = [str(idle)] if idle else []
    shown = idle is None or idle.excused
    simulation, bus = loaded.config.simulation, loaded.config.bus
    moved = report.modes.keys() & MOVED
    if moved and simulation and simulation.touches and (lockstep or isinstance(bus, SimulatedBus)):
        if report.led:
            kept, seen = _led(report)
        else:
            kept, seen = _seen(report, simulation.touches, float(simulation.hand.path[-1].at))
        shown = shown and kept
        said.append(seen)
    if not lockstep:
        said.append(_host(report, isinstance(bus, SimulatedBus)))
    return shown, f"verdict: {'; '.join(said)}" if said else ""


def _led(report: Report) -> tuple[bool, str]:
    """Limits that were passed, in a session in which a person went another way than the script."""
    passed = _passed(report)
    return not passed, f"a person led the hand, {_listed(passed) or 'no limit'} passed"


def _seen(report: Report, touches: Mapping[str, str], path_s: float) -> tuple[bool, str]:
    """Limits that were met, and whether one was passed by more than what counts as touching it."""
    limits = {limit.name: limit for limit in report.limits}
    missed = [f"{name} {end}" for name, end in touches.items() if not _met(limits.get(name), end)]
    passed = _passed(report)
    walked_s = (report.ticks + report.shed) / report.rate_hz
    whole = walked_s >= path_s
    count = f"{len(touches) - len(missed)} of {len(touches)}"
    walk = f"the whole walk of {path_s:g} s" if whole else f"{walked_s:.1f} s of a walk of {path_s:g} s"
    line = f"{walk}, {count} limits touched, {_listed(passed) or 'none'} passed"
    if whole and missed:
        line += f" (not touched: {_listed(missed)})"
    return not passed and not (whole and missed), line


def _passed(report: Report) -> list[str]:
    return [limit.name for limit in report.limits if (limit.excess or 0.0) > _near(limit)]


def _near(limit: LimitReport) -> float:
    """Limits on one side only are infinitely far apart."""
    return near(
        -inf if limit.lower is None else limit.lower,
        inf if limit.upper is None else limit.upper,
    )


def _met(limit: LimitReport | None, end: str) -> bool:
    return limit is not None and limit.touched in (end, "both")


def _listed(names: list[str]) -> str:
    return ", ".join(names)


def _host(report: Report, simulated: bool) -> str:
    share = report.skipped / max(1, report.ticks + report.shed + report.skipped)
    if share <= KEPT_UP:
        return f"this host kept up ({100 * share:.2g} % of the ticks skipped)"
    other = ", or run with --lockstep" if simulated else f"; try {program()} doctor"
    skipped = f"{100 * share:.2g} % of the ticks skipped"
    return f"this host was too busy, or the session suspended ({skipped}): close other programs{other}"
