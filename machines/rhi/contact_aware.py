"""Contact-aware null-space control (ContactAware, fig. 5): the whole controller of a redundant interface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Protocol

import numpy as np

from ...models import Array
from .guard import Span
from .manipulability import Shape
from .nullspace import Gains, NullSpace
from .passivity import Tank
from .places import Places
from .redundant import RedundantArm, Travel
from .saturation import Headroom
from .transition import Thresholds, Transition

SLOW = 0.01
"""Speed of the hand below which its direction says nothing [m/s]."""
LIGHT = 0.5
"""Force below which its direction says nothing [N]."""
SLEW_S = 0.03
"""Time in which the posture's share of the torques goes from nothing to all [s]; back in a third of it."""
FELT_S = 0.05
"""Time constant with which the direction of contact follows the measured force [s]."""
LEFT = 0.1
"""Part of a motor's torque that is counted as left to the law where the arm's weight takes more."""
ALIKE = 2e-3
"""Difference of two projectors that is not worth a turn."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Controller parameters.

    Attributes:
        shape: of the desired ellipsoids.
        gains: of the secondary torque.
        thresholds: eps1 and eps2.
        steepness: S of the reserve.
        rho: of the transition's duration (19) [s m^2]; 0 jumps.
        held: part of the limits that the force may use while the posture moves; 1 without headroom.
        moving: drive of the null space above which the posture counts as moving [N m].
        release: time to give the rest of the limits to the force [s].
        follow: time constant with which the direction of motion follows the hand [s]; inf keeps it.
        span: limits of the motors; None for none.
        linger: how long the posture waits after a contact, for another [s].
        urgency: how many times faster than (19) the transition to stiff runs, and pulls, without any reserve
            left; 1 is the paper's.
    """

    shape: Shape
    gains: Gains
    thresholds: Thresholds
    steepness: float
    rho: float
    held: float
    moving: float
    release: float
    follow: float
    span: Span | None = None
    linger: float = 0.0
    urgency: float = 1.0


class Resolution(Protocol):
    """How force and posture share the motors.

    Attributes:
        torque: (n,) [N m]; alpha: rendered share of the force.
        iterations, solves, status, levels_done: of a solver in the last tick.
        levels: name of every level that it solves, and the unit of its slack.
    """

    torque: Array
    alpha: float
    iterations: int
    solves: int
    status: int
    levels_done: int
    levels: tuple[tuple[str, str], ...]

    def resolve(self, part: float, gain: float) -> bool:
        """Compute the torques; see ``NullSpace.compose``. False where there is no answer to stand by."""

    def write_slack(self, slack: Array) -> None:
        """How far each level was from being met in the last tick, (levels,)."""


class Projection:
    """The paper's resolution: the force first, the null-space torque scaled into what it leaves."""

    iterations = solves = status = levels_done = 0
    levels: tuple[tuple[str, str], ...] = ()

    def __init__(self, space: NullSpace) -> None:
        self._space, self.torque, self.alpha = space, space.torque, 1.0

    def resolve(self, part: float, gain: float) -> bool:
        """Compose."""
        self._space.compose(part, gain)
        self.alpha = self._space.alpha
        return True

    def write_slack(self, slack: Array) -> None:
        """Nothing: it solves no levels."""


class ContactAware:
    """Renders a force with a posture that suits it: easy to move in free space, strong in contact.

    Attributes:
        arm: the interface; write its q and qd, then ``update``.
        space: secondary and null-space torques.
        transition, headroom: the actuator saturation controller.
        reserve: V of the wanted force, 0 to 1.
        tank: keeps the rendered force passive.
        motion, contact: directions of the hand's motion and of the environment's force.
        alpha: rendered share of the environment's force.
        torque: of the motors, with what holds the arm's own weight, (n,) [N m].
        places: of the surface, with postures for free motion and contact; None for none.
    """

    def __init__(
        self, arm: RedundantArm, limit: Array, u: Sequence[float], settings: Settings, dt: float
    ) -> None:
        """An arm, its limits (n,) [N m], the first direction of motion and contact (m,)."""
        self.arm, self._settings = arm, settings
        self.space = NullSpace(
            arm, limit, settings.shape, settings.gains, np.array(u, float), settings.span, dt / SLEW_S
        )
        self.resolution: Resolution = Projection(self.space)
        self.torque = np.zeros(arm.n)
        self._least, self._below = LEFT * self.space.limit, -self.space.limit
        self.transition = Transition(settings.thresholds, dt, settings.linger, settings.urgency)
        self.headroom = Headroom(settings.held, settings.moving, settings.release, dt)
        self.reserve = 1.0
        self.places: Places | None = None
        self.tank, self.alpha = Tank(arm.m), 1.0
        self._J_free = np.zeros_like(arm.J)
        self._travel = Travel(arm)
        self.motion = Direction(self.space.motion, SLOW, dt / settings.follow)
        self.contact = Direction(self.space.contact, LIGHT, dt / FELT_S)
        self._follows, self._identity = settings.follow < np.inf, np.eye(arm.m).ravel().tolist()
        self._duration = self._transition_time()

    def reset(self, granted: float = 0.0) -> None:
        """Free motion in the posture that the arm has, towards targets that it can reach from there.

        ``granted`` [J] is energy of the environment that the hand may have without putting it in.
        """
        self.arm.update()
        if self.places:
            self.places.reset(self.arm.position, self.arm.q)
        self._J_free[:] = self.arm.J
        self.transition.reset()
        self.headroom.reset()
        self.tank.reset(granted)
        self._travel.reset()
        self.space.reset()
        self.contact.reset()
        self._duration = self._transition_time()
        self.reserve = 1.0

    def update(
        self, force: Sequence[float], gain: float, potential: float = 0.0, felt: Sequence[float] | None = None
    ) -> bool:
        """Compute ``torque``; False in a singular posture or without an answer of the resolution.

        ``arm.update`` comes first: the force depends on where the hand is.

        Args:
            force: of the environment on the hand, (m,) [N].
            gain: 0 to 1, how much of force and posture control acts while the machine engages.
            potential: energy that the environment stores where the hand is [J]; 0 where it stores none.
            felt: measured force of the hand, (m,) [N]; None keeps the direction of contact.
        """
        arm, space = self.arm, self.space
        if self.places:
            self.places.follow(arm.position, arm.q)
        part = gain * self.tank.update(self._travel.update(), potential)
        wanted = [part * f for f in force]
        self._make_room()
        self._follow(wanted, felt)
        space.want(wanted)
        self.reserve = space.reserve(arm.J, self._settings.steepness)
        in_free = space.reserve(self._J_free, self._settings.steepness)
        omega = self.transition.update(self.reserve, in_free, self._duration)
        space.hurry(self.transition.haste)
        if self.transition.phase == 0.0:
            self._J_free[:] = arm.J
        solved = space.secondary(omega)
        if solved:
            held = self.headroom.update(space.drive, self.transition.turning)
            solved = self.resolution.resolve(held, gain)
        resolved = self.resolution
        self.alpha = space.ease(resolved.torque, force, part * resolved.alpha) if solved else 0.0
        self.tank.render([self.alpha * f for f in force], self.alpha)
        np.add(self.resolution.torque, arm.weight, out=self.torque)
        np.minimum(self.torque, space.limit, out=self.torque)  # where the weight takes more than is left
        np.maximum(self.torque, self._below, out=self.torque)
        return solved

    def _make_room(self) -> None:
        """What the arm's weight leaves of each motor, the same in both directions."""
        room = self.space.room
        np.abs(self.arm.weight, out=room)
        np.subtract(self.space.limit, room, out=room)
        np.maximum(room, self._least, out=room)

    def _follow(self, wanted: Sequence[float], felt: Sequence[float] | None) -> None:
        """Let the directions follow the hand's motion and force."""
        turned = self._follows and self.motion.follow(self.arm.velocity.tolist())
        if felt is not None and hypot(*wanted) > LIGHT:
            turned |= self.contact.follow(felt)
        if turned:
            self._duration = self._transition_time()

    def _transition_time(self) -> float:
        """Duration of a whole transition (19) [s]: (12) and (13) are apart by (K - zeta)(I - P_u - P_F)."""
        shape = self._settings.shape
        pairs = zip(self._identity, self.motion.flat, self.contact.flat, strict=True)
        apart = sqrt(sum((one - p - c) ** 2 for one, p, c in pairs))
        return self._settings.rho * (shape.major - shape.minor) * apart


class Direction:
    """The projector u u^T, (m, m), on a direction that follows vectors: a reversal is no turn."""

    def __init__(self, projector: Array, least: float, blend: float) -> None:
        """The projector to write; length of a vector that says nothing, and share of one in a tick."""
        self._first, self._projector = projector.ravel().tolist(), projector.ravel()
        self._least, self._blend = least, blend
        self.flat: list[float] = list(self._first)

    def reset(self) -> None:
        """The first direction."""
        self.flat = list(self._first)
        self._projector[:] = self.flat

    def follow(self, vector: Sequence[float]) -> bool:
        """Turn towards a vector (m,); False where it has no direction, or that of before."""
        size = hypot(*vector)
        if size <= self._least:
            return False
        u = [x / size for x in vector]
        wanted = [a * b for a in u for b in u]
        apart = [w - x for w, x in zip(wanted, self.flat, strict=True)]
        if max(apart) < ALIKE and min(apart) > -ALIKE:
            return False
        self.flat = [x + self._blend * d for x, d in zip(self.flat, apart, strict=True)]
        self._projector[:] = self.flat
        return True
