"""The simulated giant: arm, gantry, hand and sensors behind its simulated devices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ...devices.network import Network
from ...models import Array, Robot
from ...sim.axis_drive import SimAxisDrive
from ...sim.delay import Delay
from ...sim.dynamics import SeriesElasticArm, VelocityAxes
from ...sim.force_torque import SimForceTorque
from ...sim.hand import Hand
from ...sim.imu import SimImu
from ...sim.joint_drive import SimJointDrive
from ...sim.nodes import SimNodes
from ...sim.plant import Energies, SimPlant
from ...sim.tool import SensedTool, Tool, specific_force

GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of white sensor noise: force [N], torque [N m], acceleration [m/s^2]."""

    force: float
    torque: float
    acceleration: float


class GiantPlant(SimPlant):
    """A series-elastic arm carried by a gantry, its handle in a hand.

    Attributes:
        arm, ppu, hand, tool: the parts.
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
        delay: int = 0,
    ) -> None:
        """The robot gives the sensors' places and moves with the gantry; the drives obey delay ticks late.

        dead_man gives the times at which the switch changes.
        """
        super().__init__(network, hand, dead_man, seed)
        self.arm, self.ppu, self.hand = arm, ppu, hand
        self._robot = robot
        self._noise = np.repeat([noise.acceleration, noise.acceleration, noise.force, noise.torque], 3)
        self._joints, self._axes = self.nodes.of(SimJointDrive), self.nodes.of(SimAxisDrive)
        (self._force_torque,) = self.nodes.of(SimForceTorque)
        self._imu_carriage = _imu(self.nodes, "imu_carriage")
        self._imu_handle = _imu(self.nodes, "imu_handle")
        zero = np.zeros(robot.nv)
        T_handle = np.linalg.inv(robot.placement(zero, "handle"))
        self.tool = SensedTool(tool, (T_handle @ robot.placement(zero, "force_torque"))[:3, 3].tolist())
        self._imu = (T_handle @ robot.placement(zero, "imu_handle"))[:3, 3].tolist()
        self._late = Delay(delay, len(self._joints)), Delay(delay, len(self._axes))
        self._base = np.zeros(3)
        self._wrench = arm.hold.wrench
        self._measure()

    def energies(self) -> Energies:
        """The gantry's own mass is not modelled; what it carries is."""
        arm, ppu, robot = self.arm, self.ppu, self._robot
        q, qd = self._whole(ppu.position, arm.q), self._whole(ppu.velocity, arm.qd)
        links = pin.computeKineticEnergy(robot.model, robot.data, robot.configuration(q), qd)
        potential = pin.computePotentialEnergy(robot.model, robot.data, robot.configuration(q))
        twist = arm.twist.copy()
        twist[:2] += ppu.velocity
        rotors, springs = arm.rotor_energy(), arm.spring_energy()
        base = float(np.dot(self.ppu_force, ppu.velocity))
        return Energies(links + rotors, springs, potential, float(self._wrench @ twist), base)

    @property
    def ppu_force(self) -> Array:
        """What the gantry does to the arm now so that it moves as prescribed, (2,) [N] (hybrid dynamics)."""
        arm, ppu, robot = self.arm, self.ppu, self._robot
        q = robot.configuration(self._whole(ppu.position, arm.q))
        qd, qdd = self._whole(ppu.velocity, arm.qd), self._whole(ppu.acceleration, arm.qdd)
        force: Array = pin.rnea(robot.model, robot.data, q, qd, qdd)[:2] - self._wrench[:2]
        return force

    @staticmethod
    def _whole(ppu: Sequence[float], arm: Array) -> Array:
        """Gantry and arm as the model has them, (8,)."""
        return np.array([*ppu, *arm])

    def _move(self, dt: float) -> None:
        arm, ppu = self.arm, self.ppu
        position = arm.position.tolist()
        for i in range(2):
            position[i] += ppu.position[i]
        brakes = [axis.brake for axis in self._axes]
        ppu.step(self._late[1]([axis.velocity_command for axis in self._axes], brakes), brakes, dt)
        self._base[:2] = ppu.acceleration
        self.hand.aim(arm.hold, self.time, position, arm.rotation, (*ppu.velocity, 0.0))
        torque, brakes = [joint.torque for joint in self._joints], [joint.brake for joint in self._joints]
        arm.step(self._late[0](torque, brakes), brakes, self._base, dt)

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
        at_imu = specific_force(specific, alpha, omega, self._imu)
        self._imu_handle.acceleration = [a + e for a, e in zip(at_imu, noise[3:6].tolist(), strict=True)]
        self._imu_handle.angular_velocity = omega
        wrench = self.tool.sensed(specific, alpha, omega, force, torque)
        self._force_torque.wrench = [w + e for w, e in zip(wrench, noise[6:].tolist(), strict=True)]


def _imu(nodes: SimNodes, name: str) -> SimImu:
    node = nodes[name]
    assert isinstance(node, SimImu)
    return node
