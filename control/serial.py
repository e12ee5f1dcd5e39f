"""A serial chain's kinematics and inverse dynamics for the tick, in C, with constants from pinocchio.

One call of the C core costs what a single call of pinocchio's Python binding does, and its code stays warm
between ticks; pinocchio is the reference in the tests.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ..binding import bind, pointer
from ..models import Array, ModelError, Robot
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
        self._chain = ffi.new("serial_chain *")
        self._fill(robot)
        self.frames = [Frame(self.n) for _ in frames]
        self._c_frames = ffi.new("serial_frame[]", len(frames))
        for k, name in enumerate(frames):
            self._attach(robot, name, k)

    def bind(self, q: Array, qd: Array) -> None:
        """Let ``update`` read the state from these arrays, (n,)."""
        self._state = [pointer(array, "const double", self.n) for array in (q, qd)]

    def update(self) -> None:
        """Compute the frames at the bound state."""
        lib.serial_frames(self._chain, *self._state, self._c_frames, len(self.frames))

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

    def inertia_arguments(self, q: Array, M: Array) -> Sequence[object]:
        """Arguments of ``lib.serial_inertia`` for these arrays: (n,) and (n, n)."""
        n = self.n
        return [self._chain, pointer(q, "const double", n), pointer(M, "double", n, n)]

    def _fill(self, robot: Robot) -> None:
        model = robot.model
        if self.n > lib.SERIAL_MAX_JOINTS:
            raise ModelError(
                model.name, 0, f"{self.n} joints", f"at most {lib.SERIAL_MAX_JOINTS} are supported"
            )
        self._chain.n = self.n
        for i in range(self.n):
            joint, c = model.joints[i + 1], self._chain.joint[i]
            prismatic, axis = _axis(model.name, model.names[i + 1], joint)
            if model.parents[i + 1] != i:
                raise ModelError(
                    model.name, 0, f"'{model.names[i + 1]}' branches off", "a serial chain is needed"
                )
            c.R, c.t = _pose(model.jointPlacements[i + 1])
            c.axis, c.prismatic = axis, prismatic
            body = model.inertias[i + 1]
            c.mass, c.centre = body.mass, body.lever.tolist()
            c.inertia = np.asarray(body.inertia).reshape(-1).tolist()

    def _attach(self, robot: Robot, name: str, index: int) -> None:
        own, frame, c = robot.model.frames[robot.frame(name)], self.frames[index], self._c_frames[index]
        c.joint = int(own.parentJoint) - 1
        c.R, c.t = _pose(own.placement)
        results = {"position": frame.position, "rotation": frame.rotation, "J": frame.J, "drift": frame.drift}
        bind(lib, self._c_frames, {"n": self.n}, index, **results)


def _axis(robot: str, name: str, joint: pin.JointModel) -> tuple[bool, list[float]]:
    """Whether a joint slides, and its axis in its own frame (3,)."""
    if joint.nv != 1:
        kind = joint.shortname().removeprefix("JointModel")
        raise ModelError(robot, 0, f"joint '{name}' is a {kind}", "use joints that turn or slide")
    data = joint.createData()
    joint.calc(data, pin.neutral(_alone(joint)))
    linear, angular = np.asarray(data.S).reshape(2, 3)
    return bool(linear.any()), (linear if linear.any() else angular).tolist()


def _alone(joint: pin.JointModel) -> pin.Model:
    """A model of one joint, whose neutral configuration is the joint's."""
    model = pin.Model()
    model.addJoint(0, joint, pin.SE3.Identity(), "joint")
    return model


def _pose(placement: object) -> tuple[list[float], list[float]]:
    return placement.rotation.reshape(-1).tolist(), placement.translation.tolist()  # type: ignore[attr-defined]


def _flat(T: Array) -> tuple[list[float], list[float]]:
    return T[:3, :3].reshape(-1).tolist(), T[:3, 3].tolist()
