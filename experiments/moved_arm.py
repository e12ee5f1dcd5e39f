"""An operator arm in a hand, without bus and modes: law and plant step by step.

The plant is not what the law believes: its masses differ, its joints rub, its sensor is filtered and late.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import exp, pi

import numpy as np
import pinocchio as pin

from ..configs import read_text
from ..control.hand_wrench import HandWrench, Load
from ..control.limit_avoidance import POSITION, VELOCITY, Avoidance, JointLimits, LimitAvoidance
from ..control.operator_law import OperatorLaw
from ..control.task_arm import Posture, TaskArm
from ..models import Array, Robot
from ..sim.delay import Delay
from ..sim.dynamics import DirectArm
from ..sim.friction import Friction
from ..sim.tool import SensedTool, Tool

DT = 1e-3
SENSOR_EVERY = 2
"""Ticks: the force-torque sensor runs at 500 Hz."""
CUT_OFF = 15.0
"""Of its low-pass [Hz]."""
GRAVITY = np.array([0.0, 0.0, -9.81])
HOME = np.array([0.0, -0.5, 0.0, -2.1, 0.0, 1.8, 0.785])
"""In the middle of the Panda's workspace [rad]."""
PALM = "handle"
HANDLE = Tool(0.5, (0.0, 0.0, -0.03), (6e-4, 6e-4, 2e-4))
"""As in the built-in model; the sensor is taken to sit where the palm is."""

LATE = 1
"""Ticks that drives obey late: a command takes one on the bus."""


@dataclass(frozen=True, slots=True)
class Grip:
    """Of a hand, translation and rotation: [N/m, N m/rad], [N s/m, N m s/rad]."""

    stiffness: tuple[float, float] = (1000.0, 30.0)
    damping: tuple[float, float] = (30.0, 1.0)


@dataclass(frozen=True, slots=True)
class Doubt:
    """What of the plant is not what the law believes.

    Attributes:
        masses: a factor for each link, (n,).
        friction: dry, of each joint, (n,) [N m].
        delay: of the measured wrench beside filter and sample, ticks.
    """

    masses: Array
    friction: Array
    delay: int = 0


def panda() -> Robot:
    """The built-in model with a handle on a force-torque sensor."""
    return Robot.from_urdf(read_text("panda.urdf"), "panda.urdf")


def panda_doubt(seed: int) -> Doubt:
    """Masses off by up to 10 %, and the dry friction of a good gear."""
    random = np.random.default_rng(seed)
    friction = np.array([0.9, 0.9, 0.9, 0.9, 0.4, 0.4, 0.4]) * random.uniform(0.7, 1.3, 7)
    return Doubt(random.uniform(0.9, 1.1, 7), friction)


def changed(robot: Robot, masses: Array) -> Robot:
    """The same robot with the inertia of each link times a factor."""
    model = robot.model.copy()
    for i, factor in enumerate(masses, 1):
        body = model.inertias[i]
        model.inertias[i] = pin.Inertia(body.mass * factor, body.lever, body.inertia * factor)
    other = Robot(model)
    other.damping = robot.damping
    return other


class LowPass:
    """First order, sampled every few ticks, and late."""

    def __init__(self, delay: int) -> None:
        self.value: Array = np.zeros(6)
        self._share = 1.0 - exp(-2.0 * pi * CUT_OFF * DT * SENSOR_EVERY)
        self._tick, self._late = 0, deque([np.zeros(6)] * (delay + 1), delay + 1)
        self._filtered: Array = np.zeros(6)

    def push(self, felt: Array) -> None:
        """Take what is felt in this tick."""
        if self._tick % SENSOR_EVERY == 0:
            self._filtered = self._filtered + self._share * (felt - self._filtered)
        self._tick += 1
        self._late.append(self._filtered)
        self.value[:] = self._late[0]


class MovedArm:
    """Plant, sensor and law of an arm whose palm a hand holds.

    Attributes:
        arm: model in the tick; avoidance, law: of the operator's side.
        plant: simulated.
        felt, limits: wrenches from the avatar, (6,), in the palm's axes; write here.
    """

    def __init__(
        self,
        robot: Robot,
        doubt: Doubt,
        posture: Posture,
        grip: Grip,
        palm: str = PALM,
        assist: float = 1.0,
        position: Avoidance = POSITION,
        velocity: Avoidance = VELOCITY,
        keep_alpha: bool = True,
        tool: Tool = HANDLE,
    ) -> None:
        n = robot.nv
        self.q, self.qd, self.measured = np.zeros(n), np.zeros(n), np.zeros(6)
        self.felt, self.limits = np.zeros(6), np.zeros(6)
        self.arm = TaskArm(robot, palm, self.q, self.qd, posture)
        span = JointLimits(robot.lower, robot.upper, robot.velocity)
        self.avoidance = LimitAvoidance(span, self.q, self.qd, position, velocity)
        load = Load(np.zeros(6), tool.mass, np.array(tool.centre))
        self.hand = HandWrench(load, np.eye(4), self.arm.palm.rotation, self.measured)
        self.law = OperatorLaw(self.arm, self.avoidance, self.hand.wrench, self.felt, self.limits, assist)
        self._keep_alpha = keep_alpha
        rubs = Friction(doubt.friction, np.full(n, 0.0), np.zeros(n))
        self.plant = DirectArm(changed(robot, doubt.masses), palm, np.zeros(n), np.zeros(n), 2, rubs)
        hold = self.plant.hold
        hold.stiffness[:], hold.damping[:], hold.strength[:] = grip.stiffness, grip.damping, 1e6
        self._tool = SensedTool(tool, (0.0, 0.0, 0.0), self.plant, hold.wrench)
        self._tool.base[:] = -GRAVITY
        self._sensor = LowPass(doubt.delay)
        self._open = np.zeros(n, np.bool_)
        self._late = Delay(LATE, n)

    def reset(self, q: Array) -> None:
        """At rest, with the hand where the palm is."""
        self.plant.reset(q)
        self.home = self.plant.position.copy()
        self._upright = self.plant.rotation.copy()
        self._tool.update()
        for _ in range(2000):
            self._sensor.push(self._tool.felt)

    def step(self, wanted: Array, rate: Array, assisted: bool = True) -> None:
        """A tick in which the hand wants the palm at a place that moves, (3,) [m], (3,) [m/s].

        Without assistance, gravity compensation and what keeps the elbow are all that moves the arm.
        """
        plant, arm, law = self.plant, self.arm, self.law
        self.q[:], self.qd[:], self.measured[:] = plant.q, plant.qd, self._sensor.value
        arm.update()
        self.avoidance.update()
        if not self._keep_alpha:
            self.avoidance.alpha[:] = 1.0
        self.hand.update()
        law.update()
        torque = arm.weight + (law.torque if assisted else 0.0)
        hold = plant.hold
        hold.error[:3] = wanted - plant.position
        hold.error[3:] = pin.log3(self._upright @ plant.rotation.T)
        hold.rate[:3] = rate
        plant.step(self._late(torque, self._open), self._open, np.zeros(3), DT)
        self._tool.update()
        self._sensor.push(self._tool.felt)
