"""Work that the hand does on a machine: its wrench along the way of the handle."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ..models import Array, Robot
from ..runtime.core.scene import MachineScene


class Work:
    """Adds up the work of a hand, tick by tick, by the trapezoid rule.

    Attributes:
        total: since the beginning, positive where the hand put it into the machine [J].
    """

    def __init__(self, robot: Robot, scene: MachineScene) -> None:
        self._robot, self._scene = robot, scene
        self._handle = robot.frame(scene.handle)
        self._place: pin.SE3 | None = None
        self._wrench: Array = np.zeros(6)
        self.total = 0.0

    def add(self, state: np.void) -> float:
        """Take a logged state; the total."""
        model, data = self._robot.model, self._robot.data
        pin.forwardKinematics(
            model, data, self._robot.configuration(np.array(self._scene.posture(state), float))
        )
        place = pin.updateFramePlacement(model, data, self._handle).copy()
        wrench = np.array(self._scene.wrench(state))
        if self._place is not None:
            turn = pin.log3(place.rotation @ self._place.rotation.T)
            way = np.concatenate([place.translation - self._place.translation, turn])
            self.total += 0.5 * float((wrench + self._wrench) @ way)
        self._place, self._wrench = place, wrench
        return self.total
