"""A redundant interface as it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from ...runtime.core.scene import Box, Grip, Plane, Strength
from .config import RhiConfig, RhiPlane
from .redundant import AXES, PLACE


class RhiScene:
    """See ``MachineScene``. Of its bodies planes are drawn; directions that its task lacks are zero."""

    parts: tuple[str, ...] = ("",)
    boxes: tuple[Box, ...] = ()

    def __init__(self, config: RhiConfig) -> None:
        rhi = config.rhi
        self.grips: tuple[Grip, ...] = (Grip("", str(rhi.task.frame)),)
        motors = rhi.motors
        self._transmission = np.array(motors.transmission)
        self._directions = [AXES.index(name) for name in rhi.task.directions[:PLACE]]
        self.strength: Strength | None = Strength(
            motors.torque, motors.transmission, tuple(self._directions), self._demand
        )
        planes = {name: body for name, body in rhi.bodies.items() if isinstance(body, RhiPlane)}
        self.planes: tuple[Plane, ...] = tuple(
            Plane(name, _three(body.point), _three([x / hypot(*body.normal) for x in body.normal]))
            for name, body in planes.items()
        )

    def posture(self, state: np.void) -> Sequence[float]:
        """Joints; logged are the angles of the motors."""
        q: list[float] = (self._transmission @ state["q"]).tolist()
        return q

    def wrench(self, state: np.void) -> Sequence[float]:
        """Of the hand on the machine: without turns in its task it turns freely in the grip."""
        return [*state["hand"].tolist(), 0.0, 0.0, 0.0][:6]

    def twin(self, state: np.void) -> None:
        """It renders bodies instead."""

    def _demand(self, state: np.void) -> Sequence[float]:
        """The force that the bodies ask for, as ``Strength`` has it."""
        force = np.zeros(3)
        force[self._directions] = state["demand"][:PLACE]
        demand: list[float] = force.tolist()
        return demand


def _three(place: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (*map(float, place), 0.0, 0.0)[:3]
    return x, y, z
