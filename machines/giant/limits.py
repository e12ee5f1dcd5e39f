"""What a session of the giant may touch."""

from __future__ import annotations

import numpy as np

from ...runtime.core.machine import LimitSpec
from ..rendering.twin import twin_limits
from .config import GiantConfig
from .kinematics import points
from .names import JOINTS


class GiantLimits:
    """What a session of the giant may touch, and the measured values of a logged state."""

    def __init__(self, config: GiantConfig) -> None:
        giant = config.giant
        manipulator, box, ppu = giant.manipulator, giant.box, giant.ppu
        groups = (
            ([name.replace("_", " ") for name in JOINTS], manipulator.lower, manipulator.upper, "rad"),
            (["tilt (singularity)"], manipulator.tilt[:1], manipulator.tilt[1:], "rad"),
            (["handle x", "handle y", "handle z"], box.lower, box.upper, "m"),
            (["elbow x", "elbow y"], box.lower[:2], box.upper[:2], "m"),
            (["PPU x", "PPU y"], ppu.lower, ppu.upper, "m"),
        )
        machine = [
            LimitSpec(name, low, high, unit)
            for names, lower, upper, unit in groups
            for name, low, high in zip(names, lower, upper, strict=True)
        ]
        twin = twin_limits(config.twins)
        self.specs = (*machine, *twin)
        self._chain = bool(twin)

    def values(self, state: np.void) -> list[float]:
        """Measured values, and the twin's, in the order of ``specs``, from a record of its state."""
        q, ppu = state["link"].tolist(), state["axis"].tolist()
        handle, elbow = points(q, ppu)
        twin = state["twin"].item() if self._chain else ()
        return [*q, q[3] + q[4], *handle, *elbow[:2], *ppu, *twin]
