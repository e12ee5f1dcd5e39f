"""Dynamics of a rigid arm whose motors drive it through a constant transmission."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ..binding import bind
from ..models import Array, Robot
from ._plant import ffi, lib
from .friction import Braked
from .hold import Hold, chain
from .links import Links


class RigidArm:
    """Rigid links in motor coordinates q, joint angles r = T q; viscous friction and brakes at the motors.

    Integration is symplectic Euler; brakes and the hand's hold on the frame's origin are implicit. A closed
    brake is dry friction. Its arrays are its own buffers: they change with each step.

    Attributes:
        hold: what the hand does to the frame: to its origin alone, three rows, or six.
        q, qd: of the motors, (n,) [rad, s]; qdd: what the last step began with, but for hand and brakes.
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

        Raises:
            ModelError: the robot is no serial chain, has other joints or too many, or lacks the frame.
        """
        n = robot.nv
        self._robot, self._rotor = robot, np.array(rotor, float)
        self._brake = np.array(brake, float)
        self._links = links = Links(robot, frame, np.zeros(n))
        links.gravity[:] = robot.model.gravity.linear
        self.q, self.qd, self.qdd = np.zeros(n), np.zeros(n), np.zeros(n)
        self.position, self.rotation = links.position, links.rotation
        self.hold = hold = Hold(rows)
        self.twist, J, inverse = np.zeros(rows), np.zeros((rows, n)), np.zeros((n, n))
        self.velocity = self.twist[:3]
        self._torque, self._force, self._dry = np.zeros(n), np.zeros(3), np.zeros(n)
        self._chain = chain(hold, inverse, J, self._dry, np.zeros(n))
        self._core = ffi.new("rigid *", {"n": n, "rows": rows})
        bind(
            lib,
            self._core,
            transmission=np.array(transmission, float),
            rotor=self._rotor,
            friction=np.array(friction, float),
            torque=self._torque,
            force=self._force,
            q=self.q,
            qd=self.qd,
            qdd=self.qdd,
            joint=links.q,
            joint_rate=links.qd,
            bias=np.zeros(n),
            inverse=inverse,
            J=J,
            twist=self.twist,
        )
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

        Raises:
            SimulationError: a state or an input is not finite.
        """
        self._torque[:], self._force[:] = torque, force
        np.multiply(self._brake, braked, out=self._dry)
        self._links.check(lib.rigid_move(self._core, self._links.core, self._chain, h))

    def energy(self) -> float:
        """Kinetic energy of links and rotors [J]."""
        robot, links = self._robot, self._links
        moving = pin.computeKineticEnergy(robot.model, robot.data, robot.configuration(links.q), links.qd)
        return float(moving + 0.5 * self._rotor @ self.qd**2)

    def potential(self) -> float:
        """Potential energy of the links in the field of gravity [J]."""
        robot = self._robot
        q = robot.configuration(self._links.q)
        return float(pin.computePotentialEnergy(robot.model, robot.data, q))

    def _observe(self) -> None:
        self._links.check(lib.rigid_observe(self._core, self._links.core))
