"""A redundant interface as it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from ...runtime.core.scene import Box, Grip, Plane
from .config import RhiConfig, RhiPlane


class RhiScene:
    """See ``MachineScene``. Of its bodies planes are drawn; directions that its task lacks are zero."""

    parts: tuple[str, ...] = ("",)
    boxes: tuple[Box, ...] = ()

    def __init__(self, config: RhiConfig) -> None:
        rhi = config.rhi
        self.grips: tuple[Grip, ...] = (Grip("", str(rhi.task.frame)),)
        planes = {name: body for name, body in rhi.bodies.items() if isinstance(body, RhiPlane)}
        self.planes: tuple[Plane, ...] = tuple(
            Plane(name, _three(body.point), _three([x / hypot(*body.normal) for x in body.normal]))
            for name, body in planes.items()
        )

    def posture(self, state: np.void) -> Sequence[float]:
        """Joints."""
        q: list[float] = state["q"].tolist()
        return q

    def wrench(self, state: np.void) -> Sequence[float]:
        """Of the hand on the machine: it turns freely in the grip."""
        return [*state["hand"].tolist(), 0.0, 0.0, 0.0]

    def twin(self, state: np.void) -> None:
        """It renders bodies instead."""


def _three(place: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (*map(float, place), 0.0, 0.0)[:3]
    return x, y, z
