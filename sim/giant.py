"""The simulated giant: arm, gantry, hand and sensors behind its simulated devices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..devices.network import Network
from ..models import Robot
from .drives import SimAxisDrive, SimJointDrive
from .dynamics import SeriesElasticArm, VelocityAxes
from .hand import Hand
from .nodes import SimNodes
from .plant import SimPlant
from .sensors import SimForceTorque, SimImu

Vector = list[float]
GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True, slots=True)
class Tool:
    """What hangs on the force-torque sensor.

    Attributes:
        mass: [kg].
        centre: of mass, in the sensor's frame, (3,) [m].
        inertia: principal moments about it, in the sensor's axes, (3,) [kg m^2].
    """

    mass: float
    centre: Sequence[float]
    inertia: Sequence[float]


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of white sensor noise: force [N], torque [N m], acceleration [m/s^2]."""

    force: float
    torque: float
    acceleration: float


class GiantPlant(SimPlant):
    """A series-elastic arm carried by a gantry, its handle in a hand.

    Attributes:
        arm, ppu, hand: the parts.
    """

    def __init__(
        self,
        network: Network,
        robot: Robot,
        arm: SeriesElasticArm,
        ppu: VelocityAxes,
        hand: Hand,
        tool: Tool,
        noise: Noise,
        dead_man: Sequence[tuple[float, bool]],
        seed: int,
    ) -> None:
        """The robot gives the sensors' places; dead_man the times at which the switch changes."""
        super().__init__(network, hand, dead_man, seed)
        self.arm, self.ppu, self.hand = arm, ppu, hand
        self._tool, self._centre = tool, list(tool.centre)
        self._noise = np.repeat([noise.acceleration, noise.acceleration, noise.force, noise.torque], 3)
        self._joints, self._axes = self.nodes.of(SimJointDrive), self.nodes.of(SimAxisDrive)
        (self._force_torque,) = self.nodes.of(SimForceTorque)
        self._imu_carriage = _imu(self.nodes, "imu_carriage")
        self._imu_handle = _imu(self.nodes, "imu_handle")
        zero = np.zeros(robot.nv)
        T_handle = np.linalg.inv(robot.placement(zero, "handle"))
        self._sensor = (T_handle @ robot.placement(zero, "force_torque"))[:3, 3].tolist()
        self._imu = (T_handle @ robot.placement(zero, "imu_handle"))[:3, 3].tolist()
        self._base = np.zeros(3)
        self._wrench = np.zeros(6)
        self._measure()

    def _move(self, dt: float) -> None:
        arm, ppu = self.arm, self.ppu
        ppu.step([axis.velocity_command for axis in self._axes], [axis.brake for axis in self._axes], dt)
        self._base[:2] = ppu.acceleration
        position, twist = arm.position.tolist(), arm.twist.tolist()
        for i in range(2):
            position[i] += ppu.position[i]
            twist[i] += ppu.velocity[i]
        self._wrench = self.hand.update(self.time, position, arm.rotation, twist)
        torque = np.array([joint.torque for joint in self._joints])
        arm.step(torque, [joint.brake for joint in self._joints], self._wrench, self._base, dt)

    def _sense(self) -> None:
        arm, ppu = self.arm, self.ppu
        rows = (
            self._joints,
            arm.motor.tolist(),
            arm.motor_rate.tolist(),
            arm.q.tolist(),
            arm.spring.tolist(),
        )
        for joint, motor, rate, q, spring in zip(*rows, strict=True):
            joint.position, joint.velocity, joint.link_position, joint.load_torque = motor, rate, q, spring
        for axis, x, v in zip(self._axes, ppu.position, ppu.velocity, strict=True):
            axis.position, axis.velocity = x, v
        noise = self._random.standard_normal(12) * self._noise
        self._imu_carriage.acceleration = (self._base - GRAVITY + noise[:3]).tolist()
        # everything else in the handle's axes, whose origin H is
        base, classical = self._base - GRAVITY, arm.acceleration
        vectors = (base + classical[:3], classical[3:], arm.twist[3:], self._wrench[:3], self._wrench[3:])
        specific, alpha, omega, force, torque = (np.array(vectors) @ arm.rotation).tolist()
        at_imu = _specific_force(specific, alpha, omega, self._imu)
        self._imu_handle.acceleration = [a + e for a, e in zip(at_imu, noise[3:6].tolist(), strict=True)]
        self._imu_handle.angular_velocity = omega
        wrench = self._sensed_wrench(specific, alpha, omega, force, torque)
        self._force_torque.wrench = [w + e for w, e in zip(wrench, noise[6:].tolist(), strict=True)]

    def _sensed_wrench(
        self, specific: Vector, alpha: Vector, omega: Vector, force: Vector, torque: Vector
    ) -> Vector:
        """What the tool exerts on the sensor: the operator's wrench, and the tool's weight and inertia."""
        tool, centre = self._tool, self._centre
        at_centre = _specific_force(
            specific, alpha, omega, [s + c for s, c in zip(self._sensor, centre, strict=True)]
        )
        pull = [-tool.mass * a for a in at_centre]
        spin = [i * a for i, a in zip(tool.inertia, alpha, strict=True)]
        gyroscopic = _cross(omega, [i * w for i, w in zip(tool.inertia, omega, strict=True)])
        lever, sag = _cross(force, self._sensor), _cross(centre, pull)
        return [
            *(f + p for f, p in zip(force, pull, strict=True)),
            *(torque[i] + lever[i] + sag[i] - spin[i] - gyroscopic[i] for i in range(3)),
        ]


def _cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _specific_force(origin: Vector, alpha: Vector, omega: Vector, point: Vector) -> Vector:
    """A - g at a point of a rigid body from that at its origin."""
    tangential, centripetal = _cross(alpha, point), _cross(omega, _cross(omega, point))
    return [o + t + c for o, t, c in zip(origin, tangential, centripetal, strict=True)]


def _imu(nodes: SimNodes, name: str) -> SimImu:
    node = nodes[name]
    assert isinstance(node, SimImu)
    return node
