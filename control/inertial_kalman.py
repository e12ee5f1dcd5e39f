"""An inertial unit on the last link corrects what the joints' filters know of their links.

The unit feels the motion of all joints at once, in its own axes:

    angular velocity = R^T J_w qd + b_w       specific force = R^T (J_v qdd + Jdot qd + a - g) + b_a

with the rotation R of the unit, the acceleration a of what carries the arm, gravity g, and biases b, which
take up whatever lasts: offsets, wrong gains, a mount that is a little askew. After each joint's own filter,
all states and the biases are corrected together by the gain K = P H^T (H P H^T + R)^-1. P is block-diagonal
and constant: the covariances of the joints' filters and the doubt in the biases. For such a P neither step
lets an error grow in the metric of P^-1, so no posture and no change of it makes the estimate unstable.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..binding import bind
from ..models import Array, Robot
from ._kernels import ffi, lib
from .joint_kalman import JointKalman
from .serial import SerialChain


@dataclass(frozen=True, slots=True)
class InertialNoise:
    """Standard deviations of what an inertial unit says, as they are believed.

    Attributes:
        acceleration: noise of the accelerometer, with that of what carries the arm [m/s^2].
        rate: of the gyroscope [rad/s].
        acceleration_bias, rate_bias: doubt in the biases from tick to tick; the larger the sooner they are
            learnt, and the less slow motion is corrected.
    """

    acceleration: float = 0.05
    rate: float = 2e-3
    acceleration_bias: float = 5e-3
    rate_bias: float = 3e-4


class InertialKalman:
    """Filters of an arm's joints, and an inertial unit that its last link carries.

    Attributes:
        motor, motor_rate, link, link_rate, link_acceleration: as those of ``JointKalman``, corrected.
        sensed: whether the unit and the acceleration of what carries the arm are measured in this tick; if
            not, the joints' filters go on alone.
        expected: specific force and angular velocity of the unit as they were expected before the last
            correction, (6,) [m/s^2, rad/s].
        bias: what it measures beyond that, (6,).
    """

    def __init__(
        self,
        joints: JointKalman,
        robot: Robot,
        frame: str,
        base: Array,
        measured: tuple[Array, Array],
        noise: InertialNoise | None = None,
    ) -> None:
        """A unit at a frame of an arm; arrays are read where they are.

        Args:
            joints: the filters.
            robot: the arm.
            frame: of the unit.
            base: acceleration of what carries the arm along x and y, (2,) [m/s^2].
            measured: specific force and angular velocity in the axes of the frame, (3,) each [m/s^2, rad/s].
            noise: of the unit.

        Raises:
            ModelError: the robot lacks the frame, or is no serial chain.
        """
        noise = noise or InertialNoise()
        self._joints = joints
        self._chain = SerialChain(robot, [frame])
        self._chain.bind(joints.link, joints.link_rate)
        unit = self._chain.frames[0]
        self.sensed, self._fresh = False, True
        self.motor, self.motor_rate = joints.motor, joints.motor_rate
        self.link, self.link_rate = joints.link, joints.link_rate
        self.link_acceleration = joints.link_acceleration
        self.expected, self.bias = np.zeros(6), np.zeros(6)
        self._core = ffi.new("inertial_unit *", {"n": robot.nv})
        bind(
            lib,
            self._core,
            P=joints.covariance,
            noise=np.repeat([noise.acceleration, noise.rate], 3) ** 2,
            doubt=np.repeat([noise.acceleration_bias, noise.rate_bias], 3) ** 2,
            gravity=robot.model.gravity.linear.copy(),
            J=unit.J,
            drift=unit.drift,
            rotation=unit.rotation,
            base=base,
            specific=measured[0],
            turning=measured[1],
            expected=self.expected,
            bias=self.bias,
        )
        self._call = self._core, joints.pointer

    def reset(self) -> None:
        """At rest as measured; the biases are what the unit then measures beyond that."""
        self._joints.reset()
        self._fresh = True

    def update(self, told: Array) -> None:
        """The measurements of a tick; see ``JointKalman.update``."""
        self._joints.update(told)
        if not self.sensed:
            return
        self._chain.update()
        if self._fresh:
            lib.inertial_reset(*self._call)
        else:
            lib.inertial_correct(*self._call)
        self._fresh = False
