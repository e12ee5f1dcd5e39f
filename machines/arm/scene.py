"""An arm as it is drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...runtime.core.scene import Box, Grip, Plane, Strength
from ..rendering.scene import felt_wrench, twin_position
from .config import ArmConfig


class ArmScene:
    """See ``MachineScene``."""

    parts: tuple[str, ...] = ("",)
    planes: tuple[Plane, ...] = ()
    strength: Strength | None = None

    def __init__(self, config: ArmConfig) -> None:
        arm = config.arm
        self.grips: tuple[Grip, ...] = (Grip("", str(arm.frames.handle)),)
        self.boxes: tuple[Box, ...] = tuple(
            Box(box.frame.replace("_", " "), _corner(box.lower), _corner(box.upper))
            for box in arm.boxes or ()
        )

    def posture(self, state: np.void) -> Sequence[float]:
        """Joints, on the link side."""
        q: list[float] = state["link"].tolist()
        return q

    def wrench(self, state: np.void) -> Sequence[float]:
        """Of the hand on the machine."""
        return felt_wrench(state)

    def twin(self, state: np.void) -> Sequence[float]:
        """Place of the twin."""
        return twin_position(state)


def _corner(place: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = place
    return x, y, z
