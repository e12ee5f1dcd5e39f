"""A station between process image and gate: what does not depend on whether its arms lead or follow."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import hypot

import numpy as np
from numpy.typing import NDArray

from ...control.lease import FRESH_S, Lease
from ...control.standstill import Standstill
from ...devices.force_torque import ForceTorques
from ...devices.image import ProcessImage
from ...devices.torque_drive import JointDrives
from ...models import Array, Robot
from ...runtime.core.machine import DRIFT, REST_S
from ...runtime.core.measured import alive, sensor
from ...runtime.core.sections import Config
from ...runtime.core.stages import Mark, Stage
from ...runtime.core.torque_axes import TorqueAxes
from ...safety import Plausibility
from ..rendering.tool import tool_of
from .arm import SIDES, StationArm, chain_of
from .sections import OwnChain
from .sections import Station as Section

AT_REST = 0.05
"""Measured speeds below this are standstill [rad/s]."""
FARTHEST = 3.0
"""No palm is further from the middle of its station [m]."""
UNIT = 1e-3
"""How far the length of a quaternion may be from 1."""


def joint_names(section: Section) -> list[str]:
    """Names of the drives, left arm first."""
    return [f"{side}_joint_{i + 1}" for side in SIDES for i in range(len(getattr(section.arms, side).lower))]


def torque_axes(section: Section, robot: Robot) -> TorqueAxes:
    """What the motors of both arms may do."""
    chains: list[OwnChain] = [getattr(section.arms, side) for side in SIDES]
    return TorqueAxes(
        joint_names(section),
        lower=[x for chain in chains for x in chain.lower],
        upper=[x for chain in chains for x in chain.upper],
        velocity=[x for chain in chains for x in chain.velocity],
        torque=[x for chain in chains for x in chain_of(robot, chain).effort.tolist()],
    )


def braking(section: Section) -> float:
    """How long the slowest joint takes to brake from full speed [s]."""
    chains: list[OwnChain] = [getattr(section.arms, side) for side in SIDES]
    return max(
        v / a for chain in chains for v, a in zip(chain.velocity, section.hold.deceleration, strict=True)
    )


class Station(ABC):
    """See ``Machine``: two arms on one safety controller, each with a lease of its own.

    Attributes:
        arms: left and right; leases: theirs.
        notes: what people should be told, in words; the cycle takes them.
    """

    outputs: tuple[tuple[str, str], ...] = (("joints", "target_torque"),)
    state: np.dtype[np.void]

    def __init__(
        self, config: Config, section: Section, robot: Robot, image: ProcessImage, mark: Mark
    ) -> None:
        dt = self._dt = 1.0 / config.loop.rate
        self._mark = mark
        drives, sensors = JointDrives(image), ForceTorques(image)
        motors = torque_axes(section, robot)
        self._q, self._qd = drives.link_position, drives.velocity
        self.arms: list[StationArm] = []
        first = 0
        for i, side in enumerate(SIDES):
            own = slice(first, first := first + len(getattr(section.arms, side).lower))
            q, qd = self._q[own], self._qd[own]
            tool = tool_of(getattr(section.arms, side).tool, config.devices[f"{side}_force_torque"])
            self.arms.append(StationArm(side, section, tool, robot, q, qd, sensors.wrench[i], dt))
        self.leases = [Lease(section.link.delay, dt) for _ in self.arms]
        self._most_age = section.link.delay + FRESH_S
        self._standing = [lease.standing for lease in self.leases]
        self.axes, self.thresholds = motors.limits(config), motors.thresholds(config, image)
        self._sensors, self._scales = sensors, sensors.scales
        self._felt = [
            sensor(image, "force_torque", i, sensors.wrench[i], sensors.scales[i], dt)
            for i in range(len(SIDES))
        ]
        self.plausibility = Plausibility((motors.checks(config, image),), tuple(self._felt))
        rows = zip(motors.torque, list(section.hold.stiffness) * len(SIDES), strict=True)
        self.play = tuple(torque / stiffness for torque, stiffness in rows)
        self.braking = braking(section)
        n = len(self.axes)
        self._standstill = Standstill((AT_REST,) * n, round(REST_S * config.loop.rate))
        self.position, self.velocity, self.commands = [0.0] * n, [0.0] * n, [0.0] * n
        self.astray: list[bool] = [False] * n
        self.overload, self.inertial, self.solved = "", True, True
        self.raw_wrench: list[float] | None = None
        self.notes: list[str] = []
        self._gain, self._engaged, self._starts = 0.0, False, True

    @property
    def inside_limits(self) -> bool:
        """Whether the measured posture may be engaged."""
        return all(a.lower <= q <= a.upper for a, q in zip(self.axes, self.position, strict=True))

    def unrest(self, first: bool) -> list[str]:
        """Palms that are pulled before the first start."""
        found = []
        for arm, (force, *_, torque) in zip(self.arms, self._scales, strict=True):
            values = arm.force.wrench.tolist()
            if first and (hypot(*values[:3]) > DRIFT * force or hypot(*values[3:]) > DRIFT * torque):
                measured = f"{hypot(*values[:3]):.1f} N and {hypot(*values[3:]):.2f} N m"
                found.append(
                    f"the {arm.side} palm is pulled with {measured}; let go, or calibrate its sensor and tool"
                )
        return found

    def estimate(self) -> None:
        """Measured joints and wrenches, and what the other station says."""
        self.position, self.velocity = self._q.tolist(), self._qd.tolist()
        valid = all(
            alive(felt, self.velocity, self.thresholds) and self._sensors.ready(i)
            for i, felt in enumerate(self._felt)
        )
        self.raw_wrench = self._sensors.wrench.reshape(-1).tolist() if valid else None
        for arm in self.arms:
            arm.estimate()
        self._mark(Stage.MODEL)
        self._hear()
        for i, (arm, lease) in enumerate(zip(self.arms, self.leases, strict=True)):
            if lease.standing is not self._standing[i]:
                self._standing[i] = lease.standing
                self.notes.append(f"{arm.side} arm {lease.standing.value}")
        self._say()
        self._engaged = False  # until this tick moves the arms

    def engage(self) -> None:
        """Both arms are held where they are measured."""
        for arm in self.arms:
            arm.engage()
        self._starts = True

    def update(self, gain: float, trust: float) -> None:
        """Each arm moves by its law, or is held where it stopped itself."""
        self._standstill.reset()
        self._gain, self._engaged = gain, True
        if self._starts:
            self._starts = False
            self._begin()
        for i, arm in enumerate(self.arms):
            excess = arm.excess()
            if excess and not arm.stopped:
                arm.stopped = excess
                self.notes.append(f"{arm.side} arm stopped itself: {excess}")
                self._stop(i)
            if arm.stopped:
                arm.halt()
            else:
                self._move(i, arm, gain, trust)
        self._command()

    def brake(self, dropped: Sequence[bool]) -> bool:
        """Joints to rest at their rated decelerations; then hold."""
        still = [arm.halt() for arm in self.arms]
        self._command()
        return self._standstill.update(self.plausibility.speed, dropped) and all(still)

    def bind_state(self, state: NDArray[np.void]) -> None:
        """See ``Machine``."""
        self._logged = {name: state[name][0] for name in state.dtype.names or ()}
        fields = self._numbers()
        arrays = [array for field in fields for array in field]
        doubles = state.view(np.uint8)[: 8 * sum(map(len, arrays))].view(np.float64)
        names = list(self._logged)[: len(fields)]
        assert [self._logged[name].size for name in names] == [sum(map(len, field)) for field in fields]
        self._copied = arrays, doubles

    @abstractmethod
    def _numbers(self) -> Sequence[Sequence[Array]]:
        """What the first fields of the state are copied from: of each, what both arms have, side by side."""

    def _copy_numbers(self) -> None:
        arrays, doubles = self._copied
        np.concatenate(arrays, out=doubles)

    def _command(self) -> None:
        self.commands = [x for arm in self.arms for x in arm.torque.tolist()]

    def restart(self, i: int) -> None:
        """An act of a person ends the stop of one arm: it is held where it is, and moves on from there."""
        arm = self.arms[i]
        if arm.stopped:
            arm.stopped = ""
            self.notes.append(f"{arm.side} arm goes on")

    @abstractmethod
    def _hear(self) -> None:
        """Take what the other station says into the leases."""

    @abstractmethod
    def _say(self) -> None:
        """Tell the other station what is measured."""

    @abstractmethod
    def _begin(self) -> None:
        """The first tick in which the arms move after a start."""

    @abstractmethod
    def _stop(self, i: int) -> None:
        """An arm has just stopped itself."""

    @abstractmethod
    def _move(self, i: int, arm: StationArm, gain: float, trust: float) -> None:
        """Compute the torques of an arm."""

    @abstractmethod
    def fill(self) -> None:
        """See ``Machine``."""


def sane_pose(pose: Sequence[float]) -> bool:
    """Whether seven numbers are a pose of a palm: a place within reach, and a unit quaternion."""
    return all(abs(x) <= FARTHEST for x in pose[:3]) and abs(hypot(*pose[3:]) - 1.0) <= UNIT


def sane_wrench(wrench: Sequence[float], force: float, torque: float) -> bool:
    """Whether six numbers are a wrench of at most these magnitudes [N, N m]; what is not a number is none."""
    return hypot(*wrench[:3]) <= force and hypot(*wrench[3:]) <= torque
