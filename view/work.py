"""Work that hands do on a machine: their wrenches along the ways of the grips."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ..models import Array, Robot
from ..runtime.core.scene import MachineScene
from .geometry import Grips, drawn


class Work:
    """Adds up the work of all hands, tick by tick, by the trapezoid rule.

    Attributes:
        total: since the beginning, positive where the hands put it into the machine [J].
    """

    def __init__(self, robot: Robot, scene: MachineScene) -> None:
        self._scene, self._grips = scene, Grips(drawn(robot, scene), scene.grips)
        self._before: list[tuple[pin.SE3, Array]] = []
        self.total = 0.0

    def add(self, state: np.void) -> float:
        """Take a logged state; the total."""
        now = self._grips.place(self._scene.posture(state), self._scene.wrench(state))
        for (last, pulled), (place, wrench) in zip(self._before, now, strict=False):
            turn = pin.log3(place.rotation @ last.rotation.T)
            way = np.concatenate([place.translation - last.translation, turn])
            self.total += 0.5 * float((wrench + pulled) @ way)
        self._before = now
        return self.total
