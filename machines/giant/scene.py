"""The giant as it is drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...runtime.core.scene import Box, Grip, Plane, Strength
from ..rendering.scene import felt_wrench, twin_position
from .config import GiantConfig


class GiantScene:
    """See ``MachineScene``."""

    grips: tuple[Grip, ...] = (Grip("", "handle"),)
    parts: tuple[str, ...] = ("",)
    planes: tuple[Plane, ...] = ()
    strength: Strength | None = None

    def __init__(self, config: GiantConfig) -> None:
        box, ppu = config.giant.box, config.giant.ppu
        (x, y), (far_x, far_y) = ppu.lower, ppu.upper
        self.boxes: tuple[Box, ...] = (
            Box("handle and elbow", _corner(box.lower), _corner(box.upper)),
            Box("PPU", (x, y, 0.0), (far_x, far_y, 0.0)),
        )

    def posture(self, state: np.void) -> Sequence[float]:
        """Gantry, then joints."""
        return [*state["axis"].tolist(), *state["link"].tolist()]

    def wrench(self, state: np.void) -> Sequence[float]:
        """Of the hand on the machine."""
        return felt_wrench(state)

    def twin(self, state: np.void) -> Sequence[float]:
        """Place of the twin."""
        return twin_position(state)


def _corner(place: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = place
    return x, y, z
