"""Dynamics of a rigid arm whose motors drive it through a constant transmission."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ..binding.bind import pointer
from ..models import Array, Robot
from ._plant import lib
from .friction import Braked
from .hold import Hold, chain


class RigidArm:
    """Rigid links in motor coordinates q, joint angles r = T q; viscous friction and brakes at the motors.

    Integration is symplectic Euler; brakes and the hand's hold on the frame's origin are implicit. A closed
    brake is dry friction.

    Attributes:
        hold: what the hand does to the frame: to its origin alone, three rows, or six.
        q, qd, qdd: of the motors, (n,) [rad, s].
        position, velocity: of the frame's origin, (3,) [m, m/s]; rotation: of the frame, (3, 3).
        twist: what the hold's wrench works along, (rows,).
    """

    def __init__(
        self,
        robot: Robot,
        frame: str,
        transmission: Array,
        rotor: Array,
        friction: Array,
        brake: Array,
        rows: int = 3,
    ) -> None:
        """T (n, n); rotor inertia [kg m^2], friction [N m s/rad], torque of the brakes [N m], (n,).

        ``rows``: of the hold.
        """
        n = robot.nv
        self._robot, self._frame = robot, robot.frame(frame)
        self._T, self._rotor = np.array(transmission, float), np.diag(np.array(rotor, float))
        self._friction, self._brake = np.array(friction, float), np.array(brake, float)
        self.q, self.qd, self.qdd = np.zeros(n), np.zeros(n), np.zeros(n)
        self.position, self.velocity, self.rotation = np.zeros(3), np.zeros(3), np.eye(3)
        self.hold = hold = Hold(rows)
        self._inverse, self._J, self._dry = np.zeros((n, n)), np.zeros((rows, n)), np.zeros(n)
        self._moves = self._J[:3]
        self._next, self._upper = np.zeros(n), np.triu(np.ones((n, n), bool))
        self._speeds = pointer(self._next, "double", n)
        self._chain = chain(hold, self._inverse, self._J, self._dry, np.zeros(n))
        self.reset(self.q)

    def reset(self, q: Array) -> None:
        """Rest at q."""
        self.q[:], self.qd[:], self.qdd[:] = q, 0.0, 0.0
        self._observe()

    def step(self, torque: Array, braked: Braked, force: Sequence[float], h: float) -> None:
        """Advance by h under constant inputs.

        Args:
            torque: of the motors, (n,) [N m].
            braked: which brakes are closed, (n,).
            force: on the frame's origin besides the hand's, (3,) [N].
            h: [s].
        """
        driven = torque - self._friction * self.qd - self._bias + self._moves.T @ np.asarray(force)
        self.qdd = self._inverse @ driven
        self._dry[:] = self._brake * braked
        self._next[:] = self.qd + h * self.qdd
        lib.held_step(self._chain, h, self._speeds)
        self.qd[:] = self._next
        self.q += h * self.qd
        self._observe()

    def energy(self) -> float:
        """Kinetic energy of links and rotors [J]."""
        return float(0.5 * self.qd @ self._M @ self.qd)

    def potential(self) -> float:
        """Potential energy of the links in the field of gravity [J]."""
        robot = self._robot
        return float(pin.computePotentialEnergy(robot.model, robot.data))

    def _observe(self) -> None:
        model, data, T = self._robot.model, self._robot.data, self._T
        pin.computeAllTerms(model, data, self._robot.configuration(T @ self.q), T @ self.qd)
        self._M = T.T @ np.where(self._upper, data.M, data.M.T) @ T + self._rotor
        self._inverse[:] = np.linalg.inv(self._M)
        self._bias = T.T @ data.nle
        pose = pin.updateFramePlacement(model, data, self._frame)
        J = pin.getFrameJacobian(model, data, self._frame, pin.LOCAL_WORLD_ALIGNED)
        self._J[:] = J[: self.hold.rows] @ T
        self.position, self.rotation = pose.translation.copy(), pose.rotation.copy()
        self.velocity, self.twist = self._moves @ self.qd, self._J @ self.qd
