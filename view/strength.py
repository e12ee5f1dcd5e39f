"""What a machine's motors can press with: the force ellipsoid, and the exact bound along one direction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ..models import Array, Robot
from ..runtime.core.scene import Grip, Strength

LEAST = 1e-9
"""Square of the grip's speed for a motor's power, [1/N^2], below which a posture carries any force."""
SPENT = 1e-3
"""Part of a motor's torque that is drawn as left where the arm's weight takes it all."""


class Pressing:
    """The strength of a machine at a grip."""

    def __init__(self, robot: Robot, grip: Grip, strength: Strength) -> None:
        self._robot, self._frame = robot, robot.frame(grip.frame)
        self._offset = np.array(grip.offset)
        self._transmission, self._directions = np.array(strength.transmission), list(strength.directions)
        self._torque = np.array(strength.torque)

    def axes(self, posture: Sequence[float]) -> list[float]:
        """Semi-axes of the force ellipsoid f^T J W^2 J^T f <= 1; ContactAware, (9).

        W = diag(1/torque), of the torques that the arm's weight leaves.

        Returns:
            Three numbers for each, in the base's axes [N]; none for a direction in which the posture carries
            any force.
        """
        weighted = self._loads(posture)
        values, vectors = np.linalg.eigh(weighted @ weighted.T)
        found = np.zeros((len(values), 3))
        found[:, self._directions] = (vectors / np.sqrt(np.maximum(values, LEAST))).T
        return [float(v) for v in found[values > LEAST].ravel()]

    def reachable(self, posture: Sequence[float], demand: Sequence[float]) -> list[float]:
        """The largest force along a demanded one (3,) that no motor is too weak for, (3,) [N]; or nothing."""
        force = np.array(demand)
        size = float(np.linalg.norm(force))
        if size == 0.0:
            return []
        unit = force / size
        share = np.abs(unit[self._directions] @ self._loads(posture))
        return [float(v) for v in unit / max(float(share.max()), np.sqrt(LEAST))]

    def _loads(self, posture: Sequence[float]) -> Array:
        """J W, (m, n) [1/N]: the share of what its weight leaves of each motor that a force takes."""
        model, data = self._robot.model, self._robot.data
        q = self._robot.configuration(np.array(posture, float))
        weight = self._transmission.T @ pin.computeGeneralizedGravity(model, data, q)
        room = np.maximum(self._torque - np.abs(weight), SPENT * self._torque)
        J = pin.computeFrameJacobian(model, data, q, self._frame, pin.LOCAL_WORLD_ALIGNED)
        offset = data.oMf[self._frame].rotation @ self._offset
        at_grip = J[:3] - pin.skew(offset) @ J[3:]
        loads: Array = at_grip[self._directions] @ self._transmission / room
        return loads
