"""Dynamics of a series-elastic arm on a base whose motion is prescribed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ..models import Array, Robot
from ._plant import ffi, lib


class SeriesElasticArm:
    """Rotor, spring and link of every joint; viscous friction; a wrench on one frame.

    The base only translates, so its acceleration is subtracted from gravity and nothing else changes.
    Integration is symplectic Euler with ``substeps`` steps a period.

    Attributes:
        q, qd, qdd: link side, (n,) [rad, s].
        motor, motor_rate: rotor side, in joint units, (n,).
        spring: torque in the springs, (n,) [N m].
        position, rotation, twist, acceleration: of the frame in B without the base's motion, (3,), (3, 3),
            (6,), (6,).
    """

    def __init__(
        self,
        robot: Robot,
        frame: str,
        rotor: Array,
        stiffness: Array,
        damping: Array,
        brake: Array,
        substeps: int,
    ) -> None:
        """Rotor inertia [kg m^2], spring [N m/rad], [N m s/rad], holding torque of the brakes [N m], (n,)."""
        n = robot.nv
        self._robot = robot
        self._frame = robot.frame(frame)
        self._joint = robot.model.frames[self._frame].parentJoint
        self._rotor, self._stiffness, self._substeps = rotor, stiffness, substeps
        self._gravity = robot.model.gravity.linear.copy()
        self._forces = pin.StdVec_Force()
        for _ in range(robot.model.njoints):
            self._forces.append(pin.Force.Zero())
        self._local = robot.model.frames[self._frame].placement
        self.q, self.qd, self.qdd = np.zeros(n), np.zeros(n), np.zeros(n)
        self.motor, self.motor_rate, self.spring = np.zeros(n), np.zeros(n), np.zeros(n)
        self.position, self.rotation = np.zeros(3), np.eye(3)
        self.twist, self.acceleration = np.zeros(6), np.zeros(6)
        self._torque, self._load, self._braked = np.zeros(n), np.zeros(n), np.zeros(n, np.uint8)
        arrays = {
            **{
                "stiffness": stiffness,
                "damping": damping,
                "rotor": rotor,
                "friction": robot.damping,
                "brake": brake,
            },
            **{"torque": self._torque, "qdd": self.qdd, "q": self.q, "qd": self.qd, "motor": self.motor},
            **{"motor_rate": self.motor_rate, "spring": self.spring, "load": self._load},
        }
        self._buffers = {name: ffi.from_buffer("double[]", array) for name, array in arrays.items()}
        self._buffers["braked"] = ffi.from_buffer("unsigned char[]", self._braked)
        self._core = ffi.new("elastic *", {"n": n, **self._buffers})

    def reset(self, q: Array) -> None:
        """Rest at q with the springs loaded by gravity."""
        self.q[:], self.qd[:], self.qdd[:] = q, 0.0, 0.0
        robot = self._robot
        gravity = pin.computeGeneralizedGravity(robot.model, robot.data, robot.configuration(self.q))
        self.spring[:] = gravity
        self.motor[:], self.motor_rate[:] = q + gravity / self._stiffness, 0.0
        self._observe()

    def step(
        self, torque: Array, braked: Sequence[bool], wrench: Array, base_acceleration: Array, dt: float
    ) -> None:
        """Advance by dt under constant inputs.

        Args:
            torque: of the motors, (n,) [N m].
            braked: which rotors the brakes hold, (n,).
            wrench: on the frame in B, (6,) [N, N m].
            base_acceleration: (3,) [m/s^2].
            dt: period [s].
        """
        robot, h = self._robot, dt / self._substeps
        model, data = robot.model, robot.data
        model.gravity.linear = self._gravity - base_acceleration
        self._apply(wrench)
        self._torque[:], self._braked[:] = torque, braked
        for _ in range(self._substeps):
            lib.elastic_torques(self._core)
            self.qdd[:] = pin.aba(model, data, robot.configuration(self.q), self.qd, self._load, self._forces)
            lib.elastic_advance(self._core, h)
        self._observe()

    def energy(self) -> float:
        """Kinetic and potential energy of links, rotors and springs [J]."""
        robot = self._robot
        model, data = robot.model, robot.data
        q = robot.configuration(self.q)
        spring = self.motor - self.q
        return float(
            pin.computeKineticEnergy(model, data, q, self.qd)
            + pin.computePotentialEnergy(model, data, q)
            + 0.5 * self._rotor.dot(self.motor_rate**2)
            + 0.5 * self._stiffness.dot(spring**2)
        )

    def _apply(self, wrench: Array) -> None:
        """Wrench at the frame's origin in B, as pinocchio wants it: at the joint, in its axes."""
        R = self.rotation
        local = pin.Force(R.T @ wrench[:3], R.T @ wrench[3:])
        self._forces[self._joint] = self._local.act(local)

    def _observe(self) -> None:
        robot = self._robot
        model, data = robot.model, robot.data
        world = pin.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(model, data, robot.configuration(self.q), self.qd, self.qdd)
        pose = pin.updateFramePlacement(model, data, self._frame)
        self.position, self.rotation = pose.translation.copy(), pose.rotation.copy()
        self.twist = pin.getFrameVelocity(model, data, self._frame, world).vector.copy()
        self.acceleration = pin.getFrameClassicalAcceleration(model, data, self._frame, world).vector.copy()


class VelocityAxes:
    """Prescribed axes with a first-order velocity loop and limited acceleration (their inverters' own).

    Attributes:
        position, velocity, acceleration: one an axis [m, s].
    """

    def __init__(
        self, time_constant: float, acceleration: float, lower: Sequence[float], upper: Sequence[float]
    ) -> None:
        """Time constant of the loop [s], rated acceleration [m/s^2], hard stops, one an axis [m]."""
        self._time_constant, self._rated = time_constant, acceleration
        self._lower, self._upper = lower, upper
        self.position = [0.0] * len(lower)
        self.velocity, self.acceleration = list(self.position), list(self.position)

    def step(self, command: Sequence[float], braked: Sequence[bool], dt: float) -> None:
        """Advance by dt towards velocities, one an axis [m/s]; braked axes stop at the rated acceleration."""
        for i, before in enumerate(self.velocity):
            target, constant = (0.0, dt) if braked[i] else (command[i], self._time_constant)
            wanted = min(max((target - before) / constant, -self._rated), self._rated)
            velocity = before + dt * wanted
            position = self.position[i] + dt * velocity
            stopped = min(max(position, self._lower[i]), self._upper[i])
            if stopped != position:
                velocity = 0.0
            self.position[i], self.velocity[i] = stopped, velocity
            self.acceleration[i] = (velocity - before) / dt
