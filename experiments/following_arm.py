"""An avatar arm on a simulated Panda, without bus and modes, and what the operator's side foresees of it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..control.avatar_law import AvatarLaw, Impedance
from ..control.avatar_model import AvatarModel
from ..control.limit_avoidance import JointLimits, LimitAvoidance
from ..control.task_arm import Posture, TaskArm
from ..models import Array
from ..sim.dynamics import DirectArm
from ..sim.friction import Friction
from .moved_arm import DT, HOME, PALM, changed, panda

Joints = Callable[[float], Array]
"""Where joints are commanded to be at a time, (7,) [rad]."""


class Avatar:
    """The law on a plant whose masses are not the law's.

    Attributes:
        arm, avoidance, law: of the avatar's side; plant: simulated.
        push: wrench of the world on the palm in the station's axes, (6,); write here.
    """

    def __init__(
        self,
        home: Array = HOME,
        posture: Array = HOME,
        masses: float = 1.0,
        friction: float = 0.0,
        impedance: Impedance | None = None,
    ) -> None:
        robot = panda()
        self.q, self.qd, self.push = home.copy(), np.zeros(7), np.zeros(6)
        self.arm = TaskArm(robot, PALM, self.q, self.qd, Posture(posture))
        span = JointLimits(robot.lower, robot.upper, robot.velocity)
        self.avoidance = LimitAvoidance(span, self.q, self.qd)
        self.law = AvatarLaw(self.arm, self.avoidance, impedance or Impedance(), DT)
        rubs = Friction(np.full(7, friction), np.zeros(7), np.zeros(7))
        wrong = changed(robot, np.full(7, masses))
        self.plant = DirectArm(wrong, PALM, np.zeros(7), np.zeros(7), 2, rubs)
        self.plant.reset(home)
        self.arm.update()
        self.law.reset()
        self._none, self._still = np.zeros(7, np.bool_), np.zeros(3)

    def follow_at_once(self) -> None:
        """The fade is over."""
        self.law._core.share = 1.0

    def command(self, position: Array, rotation: Array) -> None:
        """Where the palm shall go, (3,) [m] and (3, 3)."""
        self.law.commanded[:], self.law.commanded_rotation[:] = position, rotation

    def step(self, follow: bool) -> None:
        """A tick, in which there is a command to follow, or none."""
        plant, arm = self.plant, self.arm
        self.q[:], self.qd[:] = plant.q, plant.qd
        arm.update()
        self.avoidance.update()
        self.law.update(follow)
        plant.step(self.law.torque + arm.weight + arm.palm.J.T @ self.push, self._none, self._still, DT)


@dataclass(frozen=True, slots=True)
class Foretold:
    """One row a tick on the operator's side.

    Attributes:
        t: [s], (k,); reached: (k,).
        predicted, measured: joints of the avatar, (k, 7) [rad].
        ahead, behind: torques against its limits from either, (k, 7) [N m].
        lag: of loop and transport [s].
    """

    t: Array
    reached: Array
    predicted: Array
    measured: Array
    ahead: Array
    behind: Array
    lag: float


def foretell(
    joints: Joints, posture: Array, seconds: float, transport: int, friction: float = 0.0
) -> Foretold:
    """Lead the avatar's palm where joints would have it, and predict it from measurements that come late.

    Args:
        joints: commanded.
        posture: of the elbow, (7,) [rad].
        seconds: how long.
        transport: ticks that packets take, either way.
        friction: dry, of each of the avatar's joints [N m].
    """
    robot = panda()
    avatar = Avatar(joints(0.0), posture, masses=1.05, friction=friction)
    avatar.follow_at_once()
    lag = avatar_lag(transport)
    model = AvatarModel(robot, PALM, Posture(posture), lag, DT)
    span = JointLimits(robot.lower, robot.upper, robot.velocity)
    q, qd = joints(0.0).copy(), np.zeros(7)
    late = LimitAvoidance(span, q, qd)
    there: deque[tuple[Array, Array]] = deque(maxlen=transport + 1)
    back: deque[tuple[Array, Array]] = deque(maxlen=transport + 1)
    rows: list[tuple[Array, ...]] = []
    for k in range(round(seconds / DT)):
        pin.framesForwardKinematics(robot.model, robot.data, joints(k * DT))
        pose = robot.data.oMf[robot.frame(PALM)]
        there.append((pose.translation.copy(), pose.rotation.copy()))
        avatar.command(*there[0])
        avatar.step(True)
        back.append((avatar.plant.q.copy(), avatar.plant.qd.copy()))
        q[:], qd[:] = back[0]
        late.update()
        model.position[:], model.rotation[:], model.measured[:] = *there[-1], q
        model.update()
        own = model.q, q, model.limits.torque, late.torque
        rows.append((np.array(model.reached), *(each.copy() for each in own)))
    reached, *columns = (np.array(column) for column in zip(*rows, strict=True))
    predicted, measured, ahead, behind = columns
    t = np.arange(len(rows), dtype=np.float64) * DT
    return Foretold(np.asarray(t, np.float64), reached, predicted, measured, ahead, behind, lag)


def avatar_lag(transport: int) -> float:
    """D/S and transport both ways [s]."""
    return Impedance().lag + 2 * transport * DT


def lead(predicted: Array, measured: Array, level: float) -> float:
    """How much earlier the one passes a level than the other [s], (k,) each."""
    return DT * float(np.argmax(measured > level) - np.argmax(predicted > level))
