"""A serial chain's kinematics and inverse dynamics for the tick, in C, with constants from pinocchio.

One call of the C core costs what a single call of pinocchio's Python binding does, and its code stays warm
between ticks; pinocchio is the reference in the tests.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..models import Array, ModelError, Robot
from ._kernels import ffi, lib

AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


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
            ModelError: it is no serial chain, has a skew joint axis or too many joints, or lacks a frame.
        """
        self.n = robot.nv
        self._chain = ffi.new("serial_chain *")
        self._fill(robot)
        self.frames = [Frame(self.n) for _ in frames]
        self._c_frames = ffi.new("serial_frame[]", len(frames))
        self._keep = [
            self._bind(robot, name, frame, c)
            for name, frame, c in zip(frames, self.frames, self._c_frames, strict=True)
        ]

    def bind(self, q: Array, qd: Array) -> None:
        """Let ``update`` read the state from these arrays, (n,)."""
        self._state = [ffi.from_buffer("double[]", array) for array in (q, qd)]

    def update(self) -> None:
        """Compute the frames at the bound state."""
        lib.serial_frames(self._chain, *self._state, self._c_frames, len(self.frames))

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
        return [self._chain, *(ffi.from_buffer("double[]", array) for array in (q, qd, qdd, gravity, tau))]

    def _fill(self, robot: Robot) -> None:
        model = robot.model
        if self.n > lib.SERIAL_MAX_JOINTS:
            raise ModelError(
                model.name, 0, f"{self.n} joints", f"at most {lib.SERIAL_MAX_JOINTS} are supported"
            )
        self._chain.n = self.n
        for i in range(self.n):
            joint, c = model.joints[i + 1], self._chain.joint[i]
            kind, axis = joint.shortname().removeprefix("JointModel"), joint.shortname()[-1]
            if axis not in AXES or kind[:1] not in ("R", "P"):
                raise ModelError(
                    model.name,
                    0,
                    f"joint '{model.names[i + 1]}' is a {kind}",
                    "turn its frame so that x, y or z moves",
                )
            if model.parents[i + 1] != i:
                raise ModelError(
                    model.name, 0, f"'{model.names[i + 1]}' branches off", "a serial chain is needed"
                )
            c.R, c.t = _pose(model.jointPlacements[i + 1])
            c.axis, c.prismatic = AXES[axis], kind[:1] == "P"
            body = model.inertias[i + 1]
            c.mass, c.centre = body.mass, body.lever.tolist()
            c.inertia = np.asarray(body.inertia).reshape(-1).tolist()

    def _bind(self, robot: Robot, name: str, frame: Frame, c: object) -> list[object]:
        own = robot.model.frames[robot.frame(name)]
        buffers = {
            key: ffi.from_buffer("double[]", getattr(frame, key))
            for key in ("position", "rotation", "J", "drift")
        }
        c.joint = int(own.parentJoint) - 1  # type: ignore[attr-defined]
        c.R, c.t = _pose(own.placement)  # type: ignore[attr-defined]
        for key, buffer in buffers.items():
            setattr(c, key, buffer)
        return list(buffers.values())


def _pose(placement: object) -> tuple[list[float], list[float]]:
    return placement.rotation.reshape(-1).tolist(), placement.translation.tolist()  # type: ignore[attr-defined]
