"""A serial chain's kinematics and inverse dynamics for the tick, in C, with constants from pinocchio.

One call of the C core costs what a single call of pinocchio's Python binding does, and its code stays warm
between ticks; pinocchio is the reference in the tests.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..binding import bind, pointer
from ..models import Array, Robot, serial
from ._kernels import ffi, lib


class Frame:
    """A frame of the chain, in the axes of the base.

    Attributes:
        position: (3,) [m]; rotation: (3, 3).
        J: Jacobian, (6, n).
        drift: acceleration at qdd = 0, (6,).
    """

    def __init__(self, n: int) -> None:
        self.position, self.rotation = np.zeros(3), np.eye(3)
        self.J, self.drift = np.zeros((6, n)), np.zeros(6)


class SerialChain:
    """Frames and torques of a serial robot.

    Attributes:
        n: number of joints.
        frames: in the order they were asked for, own buffers.
    """

    def __init__(self, robot: Robot, frames: Sequence[str]) -> None:
        """Take the constants of a robot.

        Raises:
            ModelError: it is no serial chain, has other joints or too many, or lacks a frame.
        """
        self.n = robot.nv
        constants = serial.joints(robot, lib.SERIAL_MAX_JOINTS)
        self._chain = ffi.new("serial_chain *", {"n": self.n, "joint": constants})
        self.frames = [Frame(self.n) for _ in frames]
        self._c_frames = ffi.new("serial_frame[]", len(frames))
        for k, name in enumerate(frames):
            self._attach(robot, name, k)

    def bind(self, q: Array, qd: Array) -> None:
        """Let ``update`` read the state from these arrays, (n,)."""
        state = [pointer(array, "const double", self.n) for array in (q, qd)]
        self._at_state = self._chain, *state, self._c_frames, len(self.frames)

    def update(self) -> None:
        """Compute the frames at the bound state."""
        lib.serial_frames(*self._at_state)

    def mount(self, first: Array) -> None:
        """Put the first joint at a pose in the axes of the base, (4, 4) [m]: the base is elsewhere."""
        self._chain.joint[0].R, self._chain.joint[0].t = _flat(first)

    def fix(self, index: int, pose: Array) -> None:
        """Put one of the frames at a pose in the frame of the joint that carries it, (4, 4) [m]."""
        self._c_frames[index].R, self._c_frames[index].t = _flat(pose)

    @property
    def pointer(self) -> object:
        """The chain's constants for other parts of the C core."""
        return self._chain

    def frame_constants(self, index: int) -> object:
        """One of the frames for other parts of the C core."""
        return self._c_frames[index]

    def torque_arguments(
        self, q: Array, qd: Array, qdd: Array, gravity: Array, tau: Array
    ) -> Sequence[object]:
        """Arguments of ``lib.serial_torques`` for these arrays: (n,) each, gravity (3,)."""
        state = [pointer(array, "const double", self.n) for array in (q, qd, qdd)]
        return [self._chain, *state, pointer(gravity, "const double", 3), pointer(tau, "double", self.n)]

    def _attach(self, robot: Robot, name: str, index: int) -> None:
        frame, constants = self.frames[index], self._c_frames[index]
        for key, value in serial.frame(robot, name).items():
            setattr(constants, key, value)
        results = {"position": frame.position, "rotation": frame.rotation, "J": frame.J, "drift": frame.drift}
        bind(lib, self._c_frames, {"n": self.n}, index, **results)


def _flat(T: Array) -> tuple[list[float], list[float]]:
    return T[:3, :3].reshape(-1).tolist(), T[:3, 3].tolist()
