"""Bimanual, Fig. 6: joint 1 of the avatar's right arm, measured and predicted, on the operator's side."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..models import Array
from .following_arm import Foretold, avatar_lag, foretell, lead
from .moved_arm import DT, HOME
from .outcome import Outcome, Progress, Row

TITLE = "predictive avatar model (Fig. 6), in simulation"
TRANSPORT = 5
"""Ticks that packets take, either way; the paper's network takes less than 1 ms."""
FRICTION = 0.3
"""Dry, of each of the avatar's joints [N m]."""
SPEEDS = (0.3, 0.6)
SECONDS = 12.0
"""Of the sweep."""
NEXT_TO_LIMIT = np.array([2.7, *HOME[1:]])
"""An elbow whose home is next to the limit of joint 1."""
LIMIT, ZONE = 2.8973, float(np.radians(10.0))


def grasp(t: float) -> Array:
    """A motion to and fro, as of grasping, towards the limit of joint 1."""
    q = NEXT_TO_LIMIT.copy()
    q[0] = 2.95 - 0.2 * (1.0 + np.cos(2.0 * np.pi * t / 6.0))
    q[1] += 0.15 * np.sin(2.0 * np.pi * t / 4.0)
    q[3] += 0.2 * np.sin(2.0 * np.pi * t / 5.0)
    return q


def ramp(speed: float) -> Foretold:
    """Joint 1 at an even speed into its limit."""
    start = NEXT_TO_LIMIT.copy()
    start[0] = LIMIT - ZONE - 1.2 * speed

    def joints(t: float) -> Array:
        q = start.copy()
        q[0] += speed * t
        return q

    return foretell(joints, NEXT_TO_LIMIT, 1.9, TRANSPORT)


def run(progress: Progress) -> Outcome:
    """Two ramps and a sweep."""
    lag = avatar_lag(TRANSPORT)
    rows = [Row("delay of loop and transport", "up to 200 ms", f"{1e3 * lag:.0f} ms", "D/S and both ways")]
    figures: dict[str, Any] = {"lag_s": lag}
    for speed in SPEEDS:
        progress(f"ramp at {speed} rad/s")
        seen = ramp(speed)
        ahead = lead(-seen.ahead[:, 0], -seen.behind[:, 0], 0.1)
        figures[f"lead_s_{speed:g}"] = ahead
        note = f"{100 * abs(ahead / lag - 1):.0f} % off the delay; the avatar is simulated"
        rows.append(Row(f"lead of the limit torque at {speed:g} rad/s", "-", f"{1e3 * ahead:.0f} ms", note))
    progress("sweep")
    seen = foretell(grasp, NEXT_TO_LIMIT, SECONDS, TRANSPORT, FRICTION)
    shift = round(lag / DT)
    a, b = seen.ahead[500:-shift, 0], seen.behind[500 + shift :, 0]
    figures["correlation"] = float(np.corrcoef(a, b)[0, 1])
    rows.append(
        Row(
            "correlation of the limit torques",
            "-",
            f"{figures['correlation']:.4f}",
            "12 s, by the delay apart",
        )
    )

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        axes.plot(seen.t, seen.measured[:, 0], label="measured")
        axes.plot(seen.t, seen.predicted[:, 0], label="predicted")
        axes.set(xlabel="time [s]", ylabel="joint 1 [rad]")
        axes.legend()

    return Outcome(rows, figures, draw)
