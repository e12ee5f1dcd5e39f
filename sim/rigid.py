"""Dynamics of a rigid arm whose motors drive it through a constant transmission."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..models import Array, Robot

Braked = Sequence[bool] | NDArray[np.bool_]
"""Which brakes are closed, (n,)."""


def braked_speed(M: Array, qd: Array, braked: Braked, most: Array) -> Array:
    """Speeds (n,) after closed brakes have acted, each by the impulse that would stop its axis.

    Args:
        M: inertia, (n, n).
        qd: speeds before, (n,).
        braked: which brakes are closed, (n,).
        most: largest impulses, (n,) [N m s].
    """
    if not any(braked):
        return qd
    held = np.flatnonzero(braked)
    response = np.linalg.inv(M)[:, held]
    impulse = np.linalg.solve(response[held], -qd[held])
    stopped: Array = qd + response @ np.clip(impulse, -most[held], most[held])
    return stopped


class RigidArm:
    """Rigid links in motor coordinates q, joint angles r = T q; viscous friction and brakes at the motors.

    Integration is symplectic Euler. A closed brake holds its motor with at most its torque, by the impulse
    that would stop it within the step.

    Attributes:
        q, qd, qdd: of the motors, (n,) [rad, s].
        position, velocity: of the frame's origin, (3,) [m, m/s]; rotation: of the frame, (3, 3).
    """

    def __init__(
        self, robot: Robot, frame: str, transmission: Array, rotor: Array, friction: Array, brake: Array
    ) -> None:
        """T (n, n); rotor inertia [kg m^2], friction [N m s/rad], torque of the brakes [N m], (n,)."""
        n = robot.nv
        self._robot, self._frame = robot, robot.frame(frame)
        self._T, self._rotor = np.array(transmission, float), np.diag(np.array(rotor, float))
        self._friction, self._brake = np.array(friction, float), np.array(brake, float)
        self.q, self.qd, self.qdd = np.zeros(n), np.zeros(n), np.zeros(n)
        self.position, self.velocity, self.rotation = np.zeros(3), np.zeros(3), np.eye(3)
        self.reset(self.q)

    def reset(self, q: Array) -> None:
        """Rest at q."""
        self.q[:], self.qd[:], self.qdd[:] = q, 0.0, 0.0
        self._observe()

    def step(
        self, torque: Array, braked: Sequence[bool] | NDArray[np.bool_], force: Sequence[float], h: float
    ) -> None:
        """Advance by h under constant inputs.

        Args:
            torque: of the motors, (n,) [N m].
            braked: which brakes are closed, (n,).
            force: on the frame's origin, (3,) [N].
            h: [s].
        """
        driven = torque - self._friction * self.qd - self._bias + self._J.T @ np.asarray(force)
        self.qdd = np.linalg.solve(self._M, driven)
        qd = braked_speed(self._M, self.qd + h * self.qdd, braked, h * self._brake)
        self.qd[:] = qd
        self.q += h * qd
        self._observe()

    def energy(self) -> float:
        """Kinetic energy of links and rotors [J]."""
        return float(0.5 * self.qd @ self._M @ self.qd)

    def _observe(self) -> None:
        model, data, T = self._robot.model, self._robot.data, self._T
        pin.computeAllTerms(model, data, self._robot.configuration(T @ self.q), T @ self.qd)
        upper = np.triu(data.M)
        self._M = T.T @ (upper + np.triu(upper, 1).T) @ T + self._rotor
        self._bias = T.T @ data.nle
        pose = pin.updateFramePlacement(model, data, self._frame)
        J = pin.getFrameJacobian(model, data, self._frame, pin.LOCAL_WORLD_ALIGNED)
        self._J = J[:3] @ T
        self.position, self.rotation = pose.translation.copy(), pose.rotation.copy()
        self.velocity = self._J @ self.qd
