"""Where the avatar's head is to be: as the operator's, filtered, recentred and limited (Bimanual, III)."""

from __future__ import annotations

from dataclasses import dataclass
from math import expm1

import numpy as np
import pinocchio as pin

from ..models import Array

SMOOTH_S = 50e-3
"""Time constant of the filter: trackers jitter by a millimetre, and heads do not."""
LARGEST_JUMP = 0.3, 1.0
"""From one reading to the next: beyond that a tracker is lost, and no head is so fast [m, rad]."""


@dataclass(frozen=True, slots=True)
class NeckLimits:
    """What a neck arm may do, in each axis of its base.

    A component of a rotation vector turns no slower than its frame does: limits of its rate are limits of
    the turning.

    Attributes:
        reach: how far the head goes from its middle, (3,) [m].
        turn: how far the rotation vector goes, (3,) [rad].
        speed, rate: largest speeds [m/s, rad/s].
        acceleration, turning: largest accelerations [m/s^2, rad/s^2].
    """

    reach: Array
    turn: Array
    speed: float
    rate: float
    acceleration: float
    turning: float


class Axes:
    """Three coordinates that go to a place as fast as they may, and are able to stop before it at any time.

    Attributes:
        at, speed: (3,) each.
    """

    def __init__(self, far: Array, speed: float, acceleration: float, dt: float) -> None:
        """The furthest from 0, (3,); largest speed and acceleration of each; the period [s]."""
        self._fastest, self._step, self._dt = speed, acceleration * dt, dt
        self._far = far - self._step * dt  # what is left of the last tick of braking
        self._wanted = np.zeros(3)
        self.at, self.speed = np.zeros(3), np.zeros(3)

    def rest(self, at: Array) -> None:
        """Stand at a place (3,), or where it is furthest inside."""
        self.at[:] = self._wanted[:] = np.clip(at, -self._far, self._far)
        self.speed[:] = 0.0

    def aim(self, wanted: Array, gain: float) -> None:
        """A share of the way to another place (3,), inside."""
        self._wanted += gain * (np.clip(wanted, -self._far, self._far) - self._wanted)

    def advance(self, following: bool) -> None:
        """One tick towards the place, or to rest."""
        step, dt = self._step, self._dt
        ideal = np.zeros(3)
        if following:
            way = self._wanted - self.at
            # v^2 / 2a + v dt / 2: what braking from v takes in whole ticks, this one included
            most = np.sqrt(2.0 * step / dt * np.abs(way) + 0.25 * step * step) - 0.5 * step
            ideal = np.sign(way) * np.minimum(np.minimum(most, self._fastest), np.abs(way) / dt)
        self.speed += np.clip(ideal - self.speed, -step, step)
        self.at += dt * self.speed
        if not following:
            self._wanted[:] = self.at


class Neck:
    """Target pose of the neck arm's end, relative to its middle, from the pose of a tracked head.

    Attributes:
        position: (3,) [m]; velocity: (3,) [m/s].
        rotation: rotation vector, (3,) [rad]; rate: its rate of change, (3,) [rad/s].
        lost: whether the last reading was none.
    """

    def __init__(self, limits: NeckLimits, dt: float) -> None:
        self._gain = -expm1(-dt / SMOOTH_S)
        self._moving = Axes(limits.reach, limits.speed, limits.acceleration, dt)
        self._turning = Axes(limits.turn, limits.rate, limits.turning, dt)
        self.position, self.velocity = self._moving.at, self._moving.speed
        self.rotation, self.rate = self._turning.at, self._turning.speed
        self._seen: pin.SE3 | None = None
        self._middle = pin.SE3.Identity()
        self.lost = True
        self._following = False

    def recentre(self) -> None:
        """The head as it is seen last is the middle from now on; the arm goes there as it may."""
        if self._seen is not None:
            self._middle = self._seen.copy()
            self._following = True

    def resume(self) -> None:
        """Go on with the middle that there was: the head is back where it was seen last."""
        self._following = self._seen is not None

    def reset(self, way: Array) -> None:
        """Begin at rest where the arm is: position and rotation vector from its middle, (6,) [m, rad]."""
        self._moving.rest(way[:3])
        self._turning.rest(way[3:])
        self._following = False

    def stop(self) -> None:
        """Come to rest and stay, whatever the head does, until it is recentred."""
        self._following = False

    def update(self, position: Array, quaternion: Array) -> None:
        """Take a reading: position (3,) [m] and quaternion x, y, z, w (4,) of the head; advance by a tick.

        What is no pose, or one too far from the last, counts as lost: the arm comes to rest.
        """
        seen = _pose(position, quaternion)
        self.lost = seen is None or (self._seen is not None and _far(self._seen, seen))
        if not self.lost:
            self._seen = seen
        elif seen is not None and not self._following:
            self._seen = seen  # a tracker that is found again somewhere else; it has to be recentred
        if self.lost:
            self._following = False
        if self._following and self._seen is not None:
            head = self._middle.actInv(self._seen)
            self._moving.aim(head.translation, self._gain)
            self._turning.aim(pin.log3(head.rotation), self._gain)
        self._moving.advance(self._following)
        self._turning.advance(self._following)


def _pose(position: Array, quaternion: Array) -> pin.SE3 | None:
    length = float(np.linalg.norm(quaternion))
    if not (np.isfinite(position).all() and abs(length - 1.0) < 0.01):
        return None
    x, y, z, w = (quaternion / length).tolist()
    return pin.SE3(pin.Quaternion(w, x, y, z).toRotationMatrix(), np.array(position, float))


def _far(a: pin.SE3, b: pin.SE3) -> bool:
    moved = a.actInv(b)
    far, wide = LARGEST_JUMP
    return bool(np.linalg.norm(moved.translation) > far or np.linalg.norm(pin.log3(moved.rotation)) > wide)
