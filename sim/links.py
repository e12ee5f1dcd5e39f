"""The links of a serial arm in the C core, and one frame of them."""

from __future__ import annotations

import numpy as np

from ..binding import bind
from ..models import Array, Robot, serial
from ._plant import ffi, lib


class SimulationError(ArithmeticError):
    """The mechanics cannot go on."""


class Links:
    """What the C core (`csrc/links.h`) computes of an arm; all arrays are its own buffers.

    Attributes:
        q, qd, qdd: of the joints, (n,) [rad or m, s].
        load: what moves them, (n,) [N m or N].
        gravity: less the acceleration of the base, (3,) [m/s^2].
        inverse: of the inertia, (n, n).
        position, rotation, J, twist, acceleration: of the frame in the axes of the base,
            (3,), (3, 3), (6, n), (6,), (6,).
        core: the C struct.
    """

    def __init__(self, robot: Robot, frame: str, armature: Array) -> None:
        """The frame by its name; armature: inertia that turns with the joints and is no link, (n,).

        Raises:
            ModelError: it is no serial chain, has other joints or too many, or lacks the frame.
        """
        n = robot.nv
        self.q, self.qd, self.qdd, self.load = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
        self.gravity, self.inverse = np.zeros(3), np.zeros((n, n))
        self.position, self.rotation, self.J = np.zeros(3), np.eye(3), np.zeros((6, n))
        self.twist, self.acceleration = np.zeros(6), np.zeros(6)
        chain = {"n": n, "joint": serial.joints(robot, lib.SERIAL_MAX_JOINTS)}
        self.core = ffi.new("links *", {"chain": chain, "n": n, **serial.frame(robot, frame)})
        bind(
            lib,
            self.core,
            gravity=self.gravity,
            armature=armature,
            q=self.q,
            qd=self.qd,
            load=self.load,
            qdd=self.qdd,
            inverse=self.inverse,
            position=self.position,
            rotation=self.rotation,
            J=self.J,
            twist=self.twist,
            acceleration=self.acceleration,
        )

    def accelerate(self) -> None:
        """Compute qdd and the inverse inertia.

        Raises:
            SimulationError: the inertia is not positive definite, as where a state is not finite.
        """
        self.check(lib.links_accelerate(self.core))

    def check(self, result: int) -> None:
        """Look at what a function of the core that needs accelerations has returned; see ``accelerate``."""
        if result < 0:
            raise SimulationError(f"the simulated arm is not anywhere: its joints are at {self.q.tolist()}")

    def observe(self) -> None:
        """Compute the frame."""
        lib.links_observe(self.core)
