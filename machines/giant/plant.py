"""The simulated giant: arm, gantry, hand and sensors behind its simulated devices."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ...devices.network import Network
from ...models import Array, Robot
from ...sim.axis_drive import SimAxisDrive
from ...sim.delay import Delay
from ...sim.drive import Drives
from ...sim.dynamics import SeriesElasticArm, VelocityAxes
from ...sim.force_torque import SimForceTorque
from ...sim.gateway import Exchange
from ...sim.hand import Hand
from ...sim.joint_drive import SimJointDrive
from ...sim.plant import Energies, SimPlant
from ...sim.probes import Probe, Probes
from ...sim.tool import SensedTool, Tool
from ..rendering.giving_way import Pushes
from ..telemanipulation.leading_end import LeadingEnd
from ..telemanipulation.sections import Leads

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
        pushes: Pushes | None = None,
        leads: Leads | None = None,
    ) -> None:
        """The robot gives the sensors' places and moves with the gantry; the drives obey delay ticks late.

        dead_man gives the times at which the switch changes; leads, whom the twin leads.
        """
        super().__init__(network, hand, dead_man, seed)
        self._end = LeadingEnd(leads, self.nodes) if leads else None
        self.arm, self.ppu, self.hand = arm, ppu, hand
        self._robot = robot
        self._noise = np.repeat([noise.acceleration, noise.acceleration, noise.force, noise.torque], 3)
        self._joints = Drives(self.nodes.of(SimJointDrive))
        self._axes = Drives(self.nodes.of(SimAxisDrive))
        zero = np.zeros(robot.nv)
        T_handle = np.linalg.inv(robot.placement(zero, "handle"))
        sensors = ("force_torque", "imu_handle")
        place, unit = ((T_handle @ robot.placement(zero, name))[:3, 3].tolist() for name in sensors)
        self._late = Delay(delay, len(self._joints.command)), Delay(delay, len(self._axes.command))
        self._pushes = pushes
        self._place, self._velocity, self._acceleration = ppu.carried
        self._handle, self._wrench = np.zeros(3), arm.hold.wrench
        self.tool = SensedTool(tool, place, arm, self._wrench, unit=unit)
        self._probes = Probes([*self._encoders(), *self._sensors()], self._random)
        self._measure()

    def _encoders(self) -> Iterator[Probe]:
        arm, ppu, joints, axes = self.arm, self.ppu, self._joints, self._axes
        yield Probe(joints["position"], arm.motor)
        yield Probe(joints["velocity"], arm.motor_rate)
        yield Probe(joints["link_position"], arm.q)
        yield Probe(joints["load_torque"], arm.spring)
        yield Probe(axes["position"], ppu.position)
        yield Probe(axes["velocity"], ppu.velocity)

    def _sensors(self) -> Iterator[Probe]:
        tool, noise = self.tool, self._noise
        (force_torque,) = self.nodes.of(SimForceTorque)
        carriage, handle = (self.nodes[name].fields for name in ("imu_carriage", "imu_handle"))
        yield Probe(carriage["acceleration"], tool.base, noise[:3])
        yield Probe(handle["acceleration"], tool.specific, noise[3:6])
        yield Probe(handle["angular_velocity"], tool.omega)
        yield Probe(force_torque.fields["wrench"], tool.felt, noise[6:])

    @property
    def link(self) -> Exchange | None:
        """With the gateways of the avatar that the twin leads, where it leads one."""
        return self._end.link if self._end else None

    def connect(self) -> None:
        """See ``Connecting``."""
        if self._end:
            self._end.connect()

    def step(self, dt: float) -> None:
        """Advance plant time by dt; packets are sent and taken at its end."""
        super().step(dt)
        if self._end:
            self._end.link.step(dt)

    @property
    def hand_power(self) -> float:
        """See ``SimPlant``."""
        x, y = self.ppu.velocity
        return float(self._wrench @ self.arm.twist + self._wrench[0] * x + self._wrench[1] * y)

    def energies(self) -> Energies:
        """The gantry's own mass is not modelled; what it carries is."""
        arm, ppu, robot = self.arm, self.ppu, self._robot
        q, qd = self._whole(ppu.position, arm.q), self._whole(ppu.velocity, arm.qd)
        links = pin.computeKineticEnergy(robot.model, robot.data, robot.configuration(q), qd)
        potential = pin.computePotentialEnergy(robot.model, robot.data, robot.configuration(q))
        rotors, springs = arm.rotor_energy(), arm.spring_energy()
        base = float(np.dot(self.ppu_force, ppu.velocity))
        return Energies(links + rotors, springs, potential, self.hand_power, base)

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
        joints, axes = self._joints, self._axes
        joints.update()
        axes.update()
        np.add(arm.position, self._place, out=self._handle)
        ppu.step(self._late[1](axes.command, axes.braked), axes.braked, dt)
        self.hand.aim(arm.hold, self.time, self._handle, arm.rotation, self._velocity)
        if self._pushes:
            self._pushes.apply(self.time, arm.q, arm.push)
        arm.step(self._late[0](joints.command, joints.braked), joints.braked, self._acceleration, dt)

    def _sense(self) -> None:
        tool = self.tool
        np.subtract(self._acceleration, GRAVITY, out=tool.base)
        tool.update()
        self._probes.read()
