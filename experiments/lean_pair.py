"""Both arms of both stations and the link between them, without buses, gates and monitors: for many trials.

The laws, the passivity of the link, the plant and the scene are those of the stations; left out are the wire
(nothing is rounded), arming and fading, prediction, and everything that watches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..control.avatar_law import AvatarLaw
from ..control.lease import Granted
from ..control.link_passivity import AvatarPort, OperatorPort
from ..control.operator_law import OperatorLaw
from ..machines.avatar.config import AvatarConfig
from ..machines.avatar.machine import impedance
from ..machines.operator.config import OperatorConfig
from ..machines.rendering.tool import tool_of
from ..machines.telemanipulation.arm import SIDES, StationArm
from ..machines.telemanipulation.plant import Limb
from ..models import Array, Robot
from ..runtime.configuration import config
from ..sim.hand import Course, Grip, Hand, turned
from ..sim.scene import Scene

DT = 1e-3
SETTLES = 0.1
"""The avatar's fade here, which nobody waits for [s]."""


class LeanArm:
    """An arm of a station, simulated and controlled.

    Attributes:
        limb: the simulated one.
        own: as its station knows it.
    """

    def __init__(self, loaded: OperatorConfig | AvatarConfig, robot: Robot, side: str, seed: int) -> None:
        station = loaded.operator if isinstance(loaded, OperatorConfig) else loaded.avatar
        simulation = loaded.simulation
        assert simulation is not None
        tool = tool_of(getattr(station.arms, side).tool, loaded.devices[f"{side}_force_torque"])
        chain = getattr(station.arms, side)
        self.limb = Limb(chain, tool, simulation, robot, np.random.default_rng([seed, SIDES.index(side)]))
        self._measured = self.limb.feel(DT)
        body = self.limb.arm
        self.own = StationArm(side, station, tool, robot, body.q, body.qd, self._measured, DT)
        self._brakes = np.zeros(self.own.n, bool)
        self.own.estimate()

    def estimate(self) -> None:
        """Measure, and compute what follows from it."""
        self._measured[:] = self.limb.feel(DT)
        self.own.estimate()

    def move(self, torque: Array) -> None:
        """A period under the torques of a law."""
        self.own.move(torque, 0.0)
        self.limb.drive(self.own.torque, self._brakes, DT)


class LeadingArm(LeanArm):
    """Of the operator.

    Attributes:
        wrench: that the avatar feels, as it came, (6,); write here.
        sent: energy handed to the avatar [J].
    """

    def __init__(
        self, loaded: OperatorConfig, robot: Robot, side: str, seed: int, course: Course, feedback: float
    ) -> None:
        super().__init__(loaded, robot, side, seed)
        arm = self.own
        assert loaded.simulation is not None
        grip = loaded.simulation.hand
        held = Grip(
            (grip.stiffness, grip.rotational_stiffness),
            (grip.damping, grip.rotational_damping),
            (grip.force, grip.torque),
        )
        self._hand = Hand(course, held, turned(np.eye(3)))
        self._felt = np.zeros(6)
        self._law = OperatorLaw(
            arm.task, arm.avoidance, arm.force.wrench, self._felt, np.zeros(6), loaded.operator.assist
        )
        self._port, self._granted = OperatorPort(arm.task.palm.rotation, arm.task.twist, DT), Granted()
        self._granted.begin()
        self._feedback, self.wrench, self.sent = feedback, np.zeros(6), 0.0

    def step(self, t: float, granted: float) -> None:
        """A period from time t on [s]; granted: energy that the avatar had handed over [J]."""
        self.estimate()
        np.multiply(self.wrench, self._feedback, out=self._port.wrench)
        self._port.update(self._granted.update(granted))
        self._felt[:] = self._port.felt
        self.sent = self._port.sent
        self._law.update()
        body = self.limb.arm
        self._hand.aim(body.hold, t, body.position, body.rotation)
        self.move(self._law.torque)


class FollowingArm(LeanArm):
    """Of the avatar.

    Attributes:
        position, rotation: commanded, as they came; write here.
        sent: energy handed to the operator [J].
    """

    def __init__(self, loaded: AvatarConfig, robot: Robot, side: str, seed: int) -> None:
        super().__init__(loaded, robot, side, seed)
        arm, gains = self.own, replace(impedance(loaded.avatar), fade=SETTLES)
        felt = arm.force.wrench
        self._law = AvatarLaw(arm.task, arm.avoidance, gains, DT)
        self._port = AvatarPort(arm.task.palm.rotation, arm.task.twist, felt, gains, DT)
        self.position, self.rotation = self._port.position, self._port.rotation
        self.position[:], self.rotation[:] = arm.task.palm.position, arm.task.palm.rotation
        self._port.reset()
        self._law.reset()
        self._granted, self.sent = Granted(), 0.0
        self._granted.begin()

    def step(self, granted: float | None) -> None:
        """A period; granted: energy that the operator had handed over [J], None where nothing is felt."""
        self.estimate()
        if granted is None:
            self._law.commanded[:], self._law.commanded_rotation[:] = self.position, self.rotation
        else:
            self._port.update(self._granted.update(granted))
            self.sent = self._port.sent
            self._law.commanded[:] = self._port.reference
            self._law.commanded_rotation[:] = self._port.reference_rotation
        self._law.update(True)
        self.move(self._law.torque)


class FollowingPair:
    """The avatar's arms with their hands in a scene.

    Attributes:
        arms: left and right.
    """

    def __init__(self, scene: Scene, seed: int) -> None:
        loaded = config.load("avatar")
        assert isinstance(loaded.config, AvatarConfig)
        robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
        self.scene = scene
        self.arms = [FollowingArm(loaded.config, robot, side, seed) for side in SIDES]
        for i, arm in enumerate(self.arms):
            scene.put(i, arm.limb.arm.position, arm.limb.arm.rotation)

    def step(self, granted: Sequence[float | None]) -> None:
        """A period of both, and of the scene."""
        for i, arm in enumerate(self.arms):
            body = arm.limb.arm
            self.scene.hold(i, body.hold, body.position, body.rotation)
            arm.step(granted[i])
        self.scene.step([arm.limb.arm.hold.wrench for arm in self.arms])

    @property
    def stopped(self) -> str:
        """Which arm would stop itself, and why; "" for none."""
        for arm in self.arms:
            if excess := arm.own.excess():
                return f"{arm.own.side} arm stopped itself: {excess}"
        return ""


def leading_pair(courses: Sequence[Course], feedback: float, seed: int) -> list[LeadingArm]:
    """The operator's arms in the hands of a person."""
    loaded = config.load("operator")
    assert isinstance(loaded.config, OperatorConfig)
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    rows = zip(SIDES, courses, strict=True)
    return [LeadingArm(loaded.config, robot, side, seed, course, feedback) for side, course in rows]
