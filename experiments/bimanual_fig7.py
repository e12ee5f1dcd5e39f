"""Bimanual, Fig. 7: force to move the operator arm, controlled and with gravity compensation alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..control.task_arm import Posture
from ..models import Array
from .moved_arm import DT, HOME, Grip, MovedArm, panda, panda_doubt
from .outcome import Outcome, Progress, Row

TITLE = "force to move the operator arm (Fig. 7), in simulation"
SECONDS, SETTLE = 6.0, 0.5
WAY, RATE = np.array([0.08, 0.05, 0.1]), 0.5
"""The same motion to and fro each time [m], [Hz]."""


def forces(seed: int, assisted: bool) -> Array:
    """Of the hand on the palm, in the palm's axes, (k, 3) [N]."""
    moved = MovedArm(panda(), panda_doubt(seed), Posture(HOME), Grip())
    moved.reset(HOME)
    found, w = [], 2.0 * np.pi * RATE
    for k in range(round(SECONDS / DT)):
        t = k * DT
        moved.step(moved.home + WAY * np.sin(w * t), WAY * w * np.cos(w * t), assisted)
        found.append(moved.plant.rotation.T @ moved.plant.hold.wrench[:3])
    return np.array(found[round(SETTLE / DT) :])


def run(progress: Progress) -> Outcome:
    """The same motion twice."""
    seen = {}
    for name, assisted in (("controller", True), ("gravity compensation", False)):
        progress(name)
        seen[name] = forces(1, assisted)
    rms = {name: float(np.sqrt(np.mean(np.square(f)))) for name, f in seen.items()}
    z = {name: float(np.abs(f[:, 2]).max()) for name, f in seen.items()}
    ratio = rms["controller"] / rms["gravity compensation"]
    note = "in simulation: masses off by up to 10 %, dry friction, sensor filtered at 15 Hz"
    rows = [Row(f"rms force, {name} [N]", "-", f"{value:.1f}", note) for name, value in rms.items()]
    rows.append(
        Row("ratio of both", "clearly less force (a plot)", f"{ratio:.2f}", "assist gain 1, as printed")
    )
    rows += [Row(f"largest force along z, {name} [N]", "-", f"{value:.1f}") for name, value in z.items()]

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 2, sharey=True)
        for each, (name, force) in zip(axes, seen.items(), strict=True):
            each.plot(SETTLE + DT * np.arange(len(force)), force[:, 2])
            each.set(title=name, xlabel="time [s]")
        axes[0].set_ylabel("force along z of the palm [N]")

    return Outcome(rows, {"rms_n": rms, "ratio": ratio, "largest_z_n": z}, draw, (8.0, 3.5))
