"""A redundant interface as it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from ...runtime.core.scene import Box, Plane
from .config import RhiConfig


class RhiScene:
    """See ``MachineScene``. Directions that its task does not have are zero."""

    boxes: tuple[Box, ...] = ()

    def __init__(self, config: RhiConfig) -> None:
        rhi = config.rhi
        self.handle = str(rhi.task.frame)
        size = hypot(*rhi.wall.normal)
        normal = _three([x / size for x in rhi.wall.normal])
        self.planes: tuple[Plane, ...] = (Plane("wall", _three(rhi.wall.point), normal),)

    def posture(self, state: np.void) -> Sequence[float]:
        """Joints."""
        q: list[float] = state["q"].tolist()
        return q

    def wrench(self, state: np.void) -> Sequence[float]:
        """Of the hand on the machine: it turns freely in the grip."""
        return [*state["hand"].tolist(), 0.0, 0.0, 0.0]

    def twin(self, state: np.void) -> None:
        """It renders a wall instead."""


def _three(place: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (*map(float, place), 0.0, 0.0)[:3]
    return x, y, z
