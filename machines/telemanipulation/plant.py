"""The simulated arms of a station behind their simulated devices."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...control.ft_calibration import Tool as Calibrated
from ...devices.network import Network
from ...models import Array, Robot
from ...sim.delay import Delay
from ...sim.drive import Drives
from ...sim.dynamics import DirectArm
from ...sim.force_torque import SimForceTorque
from ...sim.gateway import Exchange, SimGateway
from ...sim.hand import Path
from ...sim.plant import Energies, Operator, SimPlant
from ...sim.smoothed import Smoothed
from ...sim.tool import SensedTool, Tool
from ...sim.torque_drive import SimTorqueDrive
from ..rendering.own_plant import own_friction, own_robot
from ..rendering.tool import tool_of
from .arm import PALM, SIDES, chain_of, palm_to_sensor
from .sections import OwnChain, Station, StationSimulation
from .wire import open_wire

GRAVITY = np.array([0.0, 0.0, -9.81])
SLOW = 4
"""Periods of the bus in which a glove, a hand, a tracker, a neck or a base samples once."""
STILL = np.zeros(3)
"""Acceleration of a base that stands."""


class Limb:
    """An arm without its devices: rigid joints with rotors, a tool on its sensor, something at its palm.

    Attributes:
        arm: its dynamics; ``arm.hold`` is what acts on the palm.
    """

    def __init__(
        self,
        chain: OwnChain,
        tool: Calibrated,
        simulation: StationSimulation,
        robot: Robot,
        random: np.random.Generator,
    ) -> None:
        own = simulation.arms
        mass = own.tool_mass * tool.mass
        body = pin.Inertia(mass, tool.centre, np.diag(own.tool_inertia))
        bare = chain_of(robot, chain)
        real = own_robot(bare, bare.names, simulation.plant)
        last = real.model.frames[real.frame(PALM)].parentJoint
        flange = real.model.frames[real.frame(f"{chain.prefix}flange")].placement
        real.model.appendBodyToJoint(last, body, flange)
        real = Robot(real.model)  # whose workspace is of the whole
        rotor, brake = np.array(own.rotor_inertia, float), np.array(own.brake, float)
        friction = own_friction(real, simulation.plant)
        self.arm = arm = DirectArm(real, PALM, rotor, brake, own.substeps, friction)
        arm.reset(np.array(chain.home, float))
        T = palm_to_sensor(chain)
        R = T[:3, :3]
        hung = Tool(mass, tool.centre.tolist(), own.tool_inertia)
        self._tool = SensedTool(hung, (R.T @ T[:3, 3]).tolist(), arm, arm.hold.wrench, R)
        self._tool.base[:] = -GRAVITY
        self._smoothed = Smoothed(6, own.cutoff, own.periods)
        self._noise, self._random = np.repeat([own.force_noise, own.torque_noise], 3), random
        self._late = Delay(int(simulation.plant.delay), real.nv)

    def drive(self, torque: Array, braked: NDArray[np.bool_], dt: float) -> None:
        """Advance by dt under torques (n,) [N m] that its motors are told, and brakes (n,)."""
        self.arm.step(self._late(torque, braked), braked, STILL, dt)

    def feel(self, dt: float) -> Array:
        """What its sensor measures dt [s] after the last time, (6,) in its own axes [N, N m]."""
        self._tool.update()
        felt = self._tool.felt + self._noise * self._random.standard_normal(6)
        return self._smoothed.take(felt, dt)

    def energies(self) -> Energies:
        """Its base stands."""
        arm = self.arm
        power = float(arm.hold.wrench @ arm.twist)
        return Energies(arm.kinetic_energy(), 0.0, arm.potential_energy(), power)


class SimArm(Limb):
    """A limb behind its simulated drives and its simulated force-torque sensor."""

    def __init__(
        self,
        chain: OwnChain,
        simulation: StationSimulation,
        robot: Robot,
        drives: Sequence[SimTorqueDrive],
        sensor: SimForceTorque,
        random: np.random.Generator,
    ) -> None:
        super().__init__(chain, tool_of(chain.tool, sensor.device), simulation, robot, random)
        arm = self.arm
        self._drives, self._sensor = Drives(drives), sensor
        self._encoders = (
            *((self._drives["position"], arm.q), (self._drives["velocity"], arm.qd)),
            *((self._drives["link_position"], arm.q), (self._drives["load_torque"], arm.spring)),
        )

    def move(self, dt: float) -> None:
        """Advance by dt under what the drives do."""
        self._drives.update()
        self.drive(self._drives.command, self._drives.braked, dt)

    def sense(self, dt: float) -> None:
        """Give the devices what they would measure dt [s] after the last time."""
        for measured, value in self._encoders:
            measured[:] = value
        self._sensor.wrench = self.feel(dt)


class StationPlant(SimPlant):
    """Two arms, their gateways to the other station, and whatever is at their palms.

    Attributes:
        arms: left and right.
        leads: whether it is the operator's.
        link: with the other station's gateways; nobody is there until it has a port.
    """

    leads: bool

    def __init__(
        self,
        station: Station,
        simulation: StationSimulation,
        robot: Robot,
        network: Network,
        operator: Operator,
    ) -> None:
        presses = [(float(press.at), press.pressed) for press in simulation.hand.dead_man]
        super().__init__(network, operator, presses, simulation.seed)
        drives, sensors = self.nodes.of(SimTorqueDrive), self.nodes.of(SimForceTorque)
        self.arms: list[SimArm] = []
        for side, sensor in zip(SIDES, sensors, strict=True):
            chain: OwnChain = getattr(station.arms, side)
            own = [drive for drive in drives if drive.device.name.startswith(f"{side}_")]
            self.arms.append(SimArm(chain, simulation, robot, own, sensor, self._random))
        self.link = Exchange(self.nodes.of(SimGateway))
        self._link, self._dt = station.link, 0.0
        self._periods = 0

    def connect(self) -> None:
        """Open the link, if the configuration says where it is."""
        if self._link.address is not None:
            self.link.port = open_wire(self.leads, self._link, self.link.sizes, self.identity())

    def identity(self) -> dict[str, str]:
        """What must be the same at the other station, by name."""
        return {}

    def step(self, dt: float) -> None:
        """Advance plant time by dt; packets are sent and taken at its end."""
        self._dt = dt
        super().step(dt)

    def energies(self) -> Energies:
        """Of both arms."""
        rows = [arm.energies() for arm in self.arms]
        sums = [sum(getattr(row, key) for row in rows) for key in ("kinetic", "stored", "potential", "hand")]
        return Energies(*sums)

    def _move(self, dt: float) -> None:
        for i, arm in enumerate(self.arms):
            self._touch(i, arm)
            arm.move(dt)

    def _equip(self, dt: float) -> None:
        """Let what is beside the arms move for dt [s], and measure."""

    def _touch(self, i: int, arm: SimArm) -> None:
        """Tell the hold of an arm's palm what is there."""
        raise NotImplementedError

    def _sense(self) -> None:
        for arm in self.arms:
            arm.sense(self._dt)
        self._periods = (self._periods + 1) % SLOW
        if self._periods == 0:
            self._equip(SLOW * self._dt)
        self.link.step(self._dt)


def hands(simulation: StationSimulation) -> tuple[Path, Path]:
    """The ways of both palms, left and right: places and rotation vectors."""
    times = [float(point.at) for point in simulation.hand.path]
    left = np.array([[*point.left, *point.left_turned] for point in simulation.hand.path])
    right = np.array([[*point.position, *point.turned] for point in simulation.hand.path])
    return Path(times, left), Path(times, right)


class Closes(Protocol):
    """How far a person wants the fingers of either hand to be closed."""

    def at(self, time: float) -> list[float]:
        """Left and right, 0 to 1, at a time [s]."""


class Script:
    """Numbers that a person wants at given times, even from one to the next, and the ends held."""

    def __init__(self, times: Sequence[float], values: Sequence[Sequence[float]]) -> None:
        """Times (k,) [s], numbers (k, c)."""
        self._times, self._rows = list(times), [tuple(map(float, row)) for row in values]
        rises, spans = np.diff(np.array(values, float), axis=0), np.diff(self._times)[:, None]
        slopes = np.divide(rises, spans, out=np.zeros(rises.shape), where=spans > 0.0)  # a jump has none
        self._slopes: list[list[float]] = slopes.tolist()

    def at(self, time: float) -> list[float]:
        """The numbers of a time [s]."""
        i = bisect_right(self._times, time) - 1
        if not 0 <= i < len(self._slopes):
            return list(self._rows[max(i, 0)])
        past = time - self._times[i]
        return [slope * past + x for slope, x in zip(self._slopes[i], self._rows[i], strict=True)]


def closing(simulation: StationSimulation) -> Script:
    """How far the fingers of either hand, left and right, are closed; open without a script."""
    rows = simulation.fingers or ()
    return Script(
        [float(row.at) for row in rows] or [0.0], [(row.left, row.right) for row in rows] or [(0.0, 0.0)]
    )


def nodding(simulation: StationSimulation) -> Script:
    """Position and rotation vector of the head; upright without a script."""
    rows = simulation.head or ()
    return Script(
        [float(row.at) for row in rows] or [0.0],
        [(*row.position, *row.turned) for row in rows] or [(0.0,) * 6],
    )


def treading(simulation: StationSimulation) -> Script:
    """Axes of the foot paddle; in the middle without a script."""
    rows = simulation.paddle or ()
    return Script([float(row.at) for row in rows] or [0.0], [row.axes for row in rows] or [(0.0,) * 3])
