"""HapticGiant, Fig. 8: an excavator as the giant's digital twin, led by its bucket."""

from __future__ import annotations

from typing import Any

import numpy as np

from .outcome import Outcome, Progress, Row
from .rendered import Trace, consistency, draw_trace, excess, rendered, seen

TITLE = "the excavator as the giant's digital twin"
SECONDS = 30.0
SWING, BOOM, STICK, BUCKET = range(4)
NEAR = 1e-3
"""A joint this close to its limit is there [rad]."""
MOVING = 0.1
"""A joint faster than this moves [rad/s]."""
BEFORE_S, AFTER_S = 0.05, 0.15
"""When the stick's speed is taken: before the bucket comes to its stop, and once that has been felt."""


def moments(trace: Trace) -> dict[str, float | None]:
    """When what the paper tells of t_a to t_e happens, each after the one before [s]; None: it does not."""
    q, qd, lower, upper = trace.q, trace.qd, trace.lower, trace.upper
    low, high = q <= lower + NEAR, q >= upper - NEAR
    at_rest = np.abs(qd[:, SWING]) < MOVING
    return seen(
        trace.t,
        {
            "t_a": high[:, BUCKET] & low[:, BOOM],
            "t_b": low[:, STICK],
            "t_c": low[:, SWING],
            "t_d": high[:, SWING],
            "t_e": at_rest & ~low.any(1) & ~high.any(1) & (qd[:, BUCKET] > MOVING) & (qd[:, STICK] > MOVING),
        },
    )


def speeds(trace: Trace, t_a: float) -> tuple[float, float]:
    """Of the stick, just before the bucket meets its stop and just after [rad/s]."""
    times = [t_a - BEFORE_S, t_a + AFTER_S]
    before, after = np.interp(times, trace.t, trace.qd[:, STICK]).tolist()
    return before, after


def run(progress: Progress) -> Outcome:
    """The excavator under Gauss's principle, with the hand of its file."""
    trace = rendered("excavator", "gauss", SECONDS, progress)
    found = moments(trace)
    t_a = found["t_a"]
    before, after = speeds(trace, t_a) if t_a is not None else (np.nan, np.nan)
    worst = consistency(trace)
    times = ", ".join(f"{name} {'-' if t is None else f'{t:.2f}'}" for name, t in found.items())
    rows = [
        Row(
            "t_a to t_e, in this order [s]",
            "t_a, t_b, t_c, t_d, t_e",
            times,
            "found by what the text tells of each; our hand is a script",
        ),
        Row(
            "t_a: the bucket meets its stop, the boom is on its own; the stick before / after [rad/s]",
            "sudden increase",
            f"{before:.2f} / {after:.2f}",
            f"{1e3 * BEFORE_S:.0f} ms before and {1e3 * AFTER_S:.0f} ms after",
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
        draw_trace(figure, trace, ("swing", "boom", "stick", "bucket"), found)

    return Outcome(rows, {"moments": found, "stick": [before, after], "deviation": worst}, draw, (8.0, 6.0))
