"""Positions, speeds and accelerations of rotors and links of series-elastic joints (HapticGiant, VI).

Of each joint a Kalman filter knows a rotor, a link and the spring between them:

    J theta'' = u - k (theta - q) + J d      q'' = k (theta - q) / M + e

with the motor's torque u, friction d and what the link carries e, accelerations that wander, and measures
both encoders, the motor's speed, and the torque sensor, k (theta - q) + b, whose bias b wanders, too: what
encoders and a wrongly believed spring contradict it by. Its gains are those of the steady state, so a tick
costs some hundred multiplications a joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..binding import bind, pointer
from ..models import Array, Robot
from ._kernels import ffi, lib

STATES, MEASURED = 7, 4
CONVERGED, MOST_DOUBLINGS = 1e-13, 60


@dataclass(frozen=True, slots=True)
class JointNoise:
    """Standard deviations of what is measured, and how fast what is not modelled wanders.

    Attributes:
        angle: of encoders [rad or m]; rate: of the motor's speed [rad/s or m/s].
        load: of the torque sensor, as a share of the joint's largest torque.
        rubbed, bias: changes of friction, and of what the torque sensor is off by, in a second, as shares of
            that torque; carried: of what a link carries, as a share of its rated acceleration.
    """

    angle: float = 1e-5
    rate: float = 2e-3
    load: float = 5e-4
    rubbed: float = 0.1
    bias: float = 2e-3
    carried: float = 0.02


def steady_state(A: Array, H: Array, Q: Array, R: Array) -> tuple[Array, Array]:
    """Gain (s, m) of a Kalman filter that has run for ever, and the covariance (s, s) of what it corrects.

    The discrete algebraic Riccati equation by structured doubling, each step of which doubles the number of
    steps of its recursion (Chu, Fan, Lin and Wang 2004).

    Args:
        A: transition, (s, s).
        H: what is measured, (m, s).
        Q: covariance of a step, (s, s).
        R: of the measurements, (m, m), regular.

    Raises:
        ValueError: it does not converge: what wanders is not seen.
    """
    s = len(A)
    a, g, h, one = A.T.copy(), H.T @ np.linalg.solve(R, H), Q.copy(), np.eye(s)
    for _ in range(MOST_DOUBLINGS):
        w = np.linalg.inv(one + g @ h)
        step = a.T @ h @ w @ a
        a, g, h = a @ w @ a, g + a @ w @ g @ a.T, h + step
        h = 0.5 * (h + h.T)
        if np.abs(step).max() <= CONVERGED * np.abs(h).max():
            return np.asarray(np.linalg.solve(H @ h @ H.T + R, H @ h).T, np.float64), h
    raise ValueError("the Riccati equation has no steady state: what wanders is not seen by any sensor")


def exponential(F: Array) -> Array:
    """exp(F) of a small matrix (s, s), by its series after halvings, which are squared away."""
    halvings = max(0, int(np.ceil(np.log2(max(np.abs(F).sum(1).max(), 1e-300)))) + 4)
    part = F / 2.0**halvings
    total: Array = np.eye(len(F))
    term = total
    for k in range(1, 15):
        term = term @ part / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def model(rotor: float, stiffness: float, inertia: float, dt: float) -> tuple[Array, Array, Array]:
    """Transition (7, 7) of a joint in dt, effect of its motor's torque (7,), what is measured (4, 7)."""
    F = np.zeros((STATES + 1, STATES + 1))
    F[0, 1] = F[2, 3] = F[1, 4] = F[3, 5] = 1.0
    F[1, [0, 2]] = np.array([-1.0, 1.0]) * stiffness / rotor
    F[3, [0, 2]] = np.array([1.0, -1.0]) * stiffness / inertia
    F[1, STATES] = 1.0 / rotor
    step = exponential(F * dt)
    H = np.zeros((MEASURED, STATES))
    H[0, 0] = H[1, 1] = H[2, 2] = H[3, 6] = 1.0
    H[3, [0, 2]] = stiffness, -stiffness
    return step[:STATES, :STATES], step[:STATES, STATES], H


def link_inertia(robot: Robot, q: Array) -> Array:
    """What each link moves about its joint at joints (n,), the others at rest, (n,) [kg m^2 or kg]."""
    inertia: Array = np.diag(pin.crba(robot.model, robot.data, robot.configuration(q))).copy()
    return inertia


class JointKalman:
    """The filters of an arm's joints; measurements are read where they are.

    Attributes:
        motor, motor_rate: rotors at the time of the measurements, (n,) [rad, rad/s; what slides m, m/s].
        link, link_rate, link_acceleration: links, likewise.
        state: of each joint, (n, 7): angle and speed of rotor and link, the accelerations d and e, and b;
            covariance: of each, as it is corrected, (n, 7, 7).
    """

    def __init__(
        self,
        rotor: Array,
        stiffness: Array,
        inertia: Array,
        torque: Array,
        acceleration: Array,
        measured: tuple[Array, Array, Array, Array],
        dt: float,
        noise: JointNoise | None = None,
    ) -> None:
        """Gains for the joints of an arm.

        Args:
            rotor: inertia, (n,) [kg m^2].
            stiffness: of the springs, (n,) [N m/rad].
            inertia: of what each link moves about its joint, roughly, (n,) [kg m^2].
            torque: largest of the joints, (n,) [N m].
            acceleration: as they are rated for, (n,) [rad/s^2].
            measured: motor angle, motor speed, link angle, torque in the spring, (n,) each.
            dt: of a tick [s].
            noise: of the sensors and of what is not modelled.
        """
        n, noise = len(rotor), noise or JointNoise()
        # a wrist that is lighter than its rotor would swing faster than ticks see
        inertia = np.maximum(inertia, rotor)
        A, B, K = np.zeros((n, STATES, STATES)), np.zeros((n, STATES)), np.zeros((n, STATES, MEASURED))
        self.state, self.covariance = np.zeros((n, STATES)), np.zeros((n, STATES, STATES))
        for i in range(n):
            A[i], B[i], H = model(rotor[i], stiffness[i], inertia[i], dt)
            wander = np.array(
                [
                    noise.rubbed * torque[i] / rotor[i],
                    noise.carried * acceleration[i],
                    noise.bias * torque[i],
                ]
            )
            Q = np.diag([1e-18, 1e-14, 1e-18, 1e-14, *(wander**2 * dt)])
            R = np.diag([noise.angle, noise.rate, noise.angle, noise.load * torque[i]]) ** 2
            K[i], ahead = steady_state(A[i], H, Q, R)
            P = ahead - K[i] @ H @ ahead
            self.covariance[i] = 0.5 * (P + P.T)
        self.motor, self.motor_rate = np.zeros(n), np.zeros(n)
        self.link, self.link_rate, self.link_acceleration = np.zeros(n), np.zeros(n), np.zeros(n)
        self._told: Array | None = None
        self._told_pointer: object = None
        self._core = ffi.new("joint_kalman *", {"n": n})
        names = "motor", "motor_rate", "link", "load"
        bind(
            lib,
            self._core,
            **dict(A=A, B=B, K=K, stiffness=stiffness.copy(), inertia=inertia),
            **dict(zip(names, measured, strict=True)),
            x=self.state,
            motor_now=self.motor,
            motor_rate_now=self.motor_rate,
            link_now=self.link,
            link_rate_now=self.link_rate,
            link_acceleration_now=self.link_acceleration,
        )

    @property
    def pointer(self) -> object:
        """The filters for other parts of the C core."""
        return self._core

    def reset(self) -> None:
        """At rest as measured."""
        lib.joint_kalman_reset(self._core)

    def update(self, told: Array) -> None:
        """The measurements of a tick.

        Args:
            told: torques of the motors between the last measurements and these, (n,) [N m].
        """
        if told is not self._told:  # bound once: it always comes in the same array
            self._told, self._told_pointer = told, pointer(told, "const double", len(self.motor), name="told")
        lib.joint_kalman_update(self._core, self._told_pointer)
