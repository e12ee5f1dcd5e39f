"""HapticGiant, Fig. 9: a door as the giant's digital twin, with its handle, its lock and its closer."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..control.chain import FREE
from .outcome import Outcome, Progress, Row
from .rendered import Trace, consistency, draw_trace, excess, rendered, seen

TITLE = "the door as the giant's digital twin"
SECONDS = 24.0
HINGE, HANDLE = 0, 1
SHUT, OPEN = 1e-3, 1e-2
"""The hinge is shut below the first, and moves beyond the second [rad]."""
FIRM = 15.0
"""A user who pulls or pushes means it from here on [N m]."""
TOP_SPEED = 0.999
"""Share of the speed limit from which on the closer brakes."""


def phases(trace: Trace, closer: float) -> dict[str, float | None]:
    """When the five phases begin, each after the one before [s]; None: it does not come.

    Args:
        trace: of the door.
        closer: speed limit of the hinge [rad/s].
    """
    hinge, speed, push = trace.q[:, HINGE], trace.qd[:, HINGE], trace.torque[:, HINGE]
    locked, shut = trace.held[:, HINGE] != FREE, hinge <= SHUT
    return seen(
        trace.t,
        {
            "t_a": locked & shut & (push > FIRM),
            "t_b": ~locked & shut & (push < -FIRM),
            "t_c": ~locked & (hinge > OPEN) & (push > 0.0),
            "t_d": hinge >= trace.upper[HINGE] - SHUT,
            "t_e": (speed <= -TOP_SPEED * closer) & (np.abs(push) < 1.0),
        },
    )


def between(trace: Trace, begin: float | None, end: float | None) -> Trace | None:
    """A part of a trace; None where one of its ends was not seen."""
    return None if begin is None or end is None else trace.part(begin, end)


def run(progress: Progress) -> Outcome:
    """The door under Gauss's principle, with the hand of its file."""
    trace = rendered("door", "gauss", SECONDS, progress)
    closer = float(trace.velocity[HINGE])
    found = phases(trace, closer)
    begin = list(found.values())
    nothing, pulled, open_, shut = (
        between(trace, begin[0], begin[1]),
        between(trace, begin[1], begin[2]),
        between(trace, begin[2], begin[3]),
        between(trace, begin[4], float(trace.t[-1])),
    )
    times = ", ".join(f"{name} {'-' if t is None else f'{t:.2f}'}" for name, t in found.items())
    worst = consistency(trace)
    rows = [
        Row("t_a to t_e, in this order [s]", "t_a, t_b, t_c, t_d, t_e", times, "our hand is a script"),
        Row(
            "t_a: pushed and pulled without the handle; user's torque [N m] / motion of the hinge [mrad]",
            "no movement",
            _most(nothing),
            "",
        ),
        Row(
            "t_b: handle pressed while pulling; user's torque [N m] / motion of the hinge [mrad]",
            "the door does not open",
            _most(pulled, pulling=True),
            "as long as the user pulls",
        ),
        Row(
            "t_c: pushed with the handle pressed; handle when the hinge leaves its limit [rad]",
            "the door pops open",
            "-" if open_ is None else f"{open_.q[0, HANDLE]:.2f}",
            "unlocks at 0.35 rad",
        ),
        Row(
            "t_e: released, it slams; fastest [rad/s] / limit [rad/s] / hinge in the end [mrad]",
            "respects the velocity limit",
            _slammed(shut, closer),
            "and locks" if shut is not None and shut.held[-1, HINGE] != FREE else "",
        ),
        Row("worst excess of the twin's limits [mrad]", "-", f"{1e3 * excess(trace):.3f}", ""),
        Row(
            "commanded acceleration against the constrained multibody system, worst deviation [%]",
            "-",
            f"{100 * worst:.1e}",
            "pinocchio and the KKT conditions of the tight limits; all ticks whose active set did not change",
        ),
    ]

    def draw(figure: Any) -> None:
        locked = trace.held[:, HINGE] != FREE
        draw_trace(figure, trace, ("hinge", "handle"), found, locked)

    return Outcome(rows, {"phases": found, "deviation": worst}, draw, (8.0, 6.0))


def _slammed(part: Trace | None, closer: float) -> str:
    """Fastest closing, its limit, and how far open the door is in the end."""
    if part is None:
        return "-"
    fastest, end = -part.qd[:, HINGE].min(), abs(part.q[-1, HINGE])
    return f"{fastest:.4f} / {closer:g} / {1e3 * end:.2f}"


def _most(part: Trace | None, pulling: bool = False) -> str:
    """Range of the torque, and motion of the hinge; of the ticks alone in which the user pulls."""
    if part is None:
        return "-"
    chosen = part.torque[:, HINGE] < 0.0 if pulling else np.full(len(part.t), True)
    push, moved = part.torque[chosen, HINGE], np.abs(part.q[chosen, HINGE])
    return f"{push.min():.0f} to {push.max():.0f} / {1e3 * moved.max():.3f}"
