"""The operator's hand: a spring and damper from the handle to where it wants to be, saturated.

That place follows a script until a person takes the hand; then it stays where the handle is, and moves as the
person pushes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Protocol

import numpy as np
import pinocchio as pin

from ..binding import bind, pointer
from ..models import Array
from ._plant import ffi, lib
from .hold import Hold

STILL = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Grip:
    """Stiffness and damping, (translation, rotation); largest force and torque (SI)."""

    stiffness: tuple[float, float]
    damping: tuple[float, float]
    strength: tuple[float, float]


class Path:
    """A smooth path through places at given times: a C2 cubic spline, at rest at both ends.

    Attributes:
        core: the C struct.
    """

    def __init__(self, times: Sequence[float], values: Array) -> None:
        """Times (k,) [s], ascending; coordinates at each of them (k, c).

        Raises:
            ValueError: for fewer than two poses or times that do not ascend.
        """
        t = np.asarray(times, float)
        if len(t) < 2 or not np.all(np.diff(t) > 0.0):
            raise ValueError(f"a path needs at least two poses at ascending times, not {list(times)}")
        y = np.asarray(values, float)
        h = np.diff(t)[:, None]
        slope = _clamped_slopes(t, y)
        m0, m1, rise = h * slope[:-1], h * slope[1:], np.diff(y, axis=0)
        a, b = m0 + m1 - 2.0 * rise, 3.0 * rise - 2.0 * m0 - m1
        self._value, self._rate = np.zeros(y.shape[1]), np.zeros(y.shape[1])
        sizes = {"segments": len(h), "knots": len(t), "columns": y.shape[1]}
        self.core = ffi.new("path *", sizes)
        cubic = np.stack([a, b, m0, y[:-1]], axis=2)
        bind(lib, self.core, time=t, cubic=cubic, value=self._value, rate=self._rate)

    def at(self, t: float) -> tuple[list[float], list[float]]:
        """Coordinates and their rates at time t; the ends are held."""
        lib.path_at(self.core, t)
        return self._value.tolist(), self._rate.tolist()


def _clamped_slopes(t: Array, y: Array) -> Array:
    """Slopes at the knots that make the cubic spline twice continuously differentiable, zero at the ends."""
    k = len(t)
    h = np.diff(t)[:, None]
    secant = np.diff(y, axis=0) / h
    system = np.eye(k)
    right: Array = np.zeros(y.shape)
    for i in range(1, k - 1):
        before, after = float(h[i - 1, 0]), float(h[i, 0])
        system[i, i - 1], system[i, i], system[i, i + 1] = after, 2.0 * (before + after), before
        right[i] = 3.0 * (after * secant[i - 1] + before * secant[i])
    return np.asarray(np.linalg.solve(system, right))


PUSH_N = 10.0
"""What one push adds to the pull of the hand [N]."""
MOST_PUSH_N = 30.0
"""What pushes pull with at most [N], whatever the strength of the hand."""


def _pushed(
    place: list[float] | Array, handle: Sequence[float] | Array, direction: Sequence[float], stiffness: float
) -> None:
    """Move the place where a person's hand wants to be, but not far from where the handle is now."""
    step, reach = PUSH_N / stiffness, MOST_PUSH_N / stiffness
    lead = [x + step * d - h for x, d, h in zip(place, direction, handle, strict=True)]
    place[:] = [h + x for h, x in zip(handle, _saturated(lead, reach), strict=True)]


Orientation = Callable[[Sequence[float], Sequence[float]], tuple[Array, tuple[float, ...]]]
"""What three angles and their rates mean: a rotation matrix in B, and the angular velocity."""


class Course(Protocol):
    """Where a hand wants to be."""

    def at(self, t: float) -> tuple[Sequence[float], Sequence[float]]:
        """Coordinates and their rates at time t."""


class Hand:
    """Holds the handle while it grips.

    The path's coordinates are position [m] and orientation, three angles [rad] of which each may be any.

    Attributes:
        gripping: whether it holds the handle; otherwise it does nothing.
    """

    def __init__(
        self, path: Course, grip: Grip, orientation: Orientation, away: Sequence[tuple[float, float]] = ()
    ) -> None:
        """``away``: from when to when the hand lets go of the handle, as long as no person leads it [s]."""
        self._grip, self._orientation, self._away = grip, orientation, away
        self.gripping = True
        self._led = False
        self._handle, self._turned, self._base = np.zeros(3), np.eye(3), np.zeros(3)
        self._place, self._target, self._rate = np.zeros(3), np.eye(3), np.zeros(6)
        own = {"stiffness": grip.stiffness, "damping": grip.damping, "strength": grip.strength}
        self._core = ffi.new("hand *", own)
        bind(
            lib,
            self._core,
            place=self._place,
            target=self._target,
            rate=self._rate,
            position=self._handle,
            rotation=self._turned,
            base=self._base,
        )
        self.follow(path)
        self._want(0.0)
        self._handle[:], self._rotation = self._place, self._target.copy()

    @property
    def handle(self) -> list[float]:
        """Where the handle is (3,) [m]."""
        handle: list[float] = self._handle.tolist()
        return handle

    def follow(self, path: Course) -> None:
        """Go another way from now on."""
        self._path, self._hanging = path, None
        if isinstance(path, Path) and path.core.columns == 6 and self._orientation is hanging:
            self._hanging = path.core

    def take(self) -> None:
        """A person leads it from now on: it wants to stay where the handle is."""
        if not self._led:
            self._led = True
            self._place[:], self._target[:], self._rate[:] = self._handle, self._rotation, 0.0

    def push(self, direction: Sequence[float]) -> None:
        """Once taken, pull the handle gently in a direction (3,)."""
        if self._led:
            _pushed(self._place, self._handle, direction, self._grip.stiffness[0])

    def lead(self, place: Sequence[float]) -> None:
        """Once taken, want the handle at a place (3,) [m], with what the grip has."""
        if self._led:
            self._place[:] = place

    def aim(
        self,
        hold: Hold,
        t: float,
        position: Sequence[float] | Array,
        rotation: Array,
        base: Sequence[float] | Array = STILL,
    ) -> None:
        """Tell its hold where it wants the handle from time t on.

        Args:
            hold: of the handle.
            t: [s].
            position: of the handle in B, (3,) [m].
            rotation: of the handle in B, (3, 3).
            base: velocity of what carries the arm, (3,) [m/s].
        """
        assert hold.rows == len(self._rate), "a hand holds a frame"
        self._rotation = rotation
        self._handle[:], self._turned[:], self._base[:] = position, rotation, base
        if not self._led:
            self._want(t)
        lib.hand_aim(self._core, hold.core, self.gripping and not self._lets_go(t))

    def _lets_go(self, t: float) -> bool:
        if self._led or not self._away:
            return False
        return any(begin <= t < end for begin, end in self._away)

    def _want(self, t: float) -> None:
        """Where its path is at a time."""
        if self._hanging is not None:
            lib.hand_follow(self._core, self._hanging, t)
            return
        value, rate = self._path.at(t)
        rotation, omega = self._orientation(value[3:], rate[3:])
        self._place[:], self._target[:], self._rate[:] = value[:3], rotation, (*rate[:3], *omega)


class PointHand:
    """Force on a handle that turns freely in the grip: a spring and damper to a course, saturated.

    ``aim`` is for dynamics that integrate the hold together with what is held, ``force`` for those that take
    forces as they are: with these a stiff grip on a light handle is not stable.
    """

    def __init__(self, course: Course, stiffness: float, damping: float, strength: float) -> None:
        """Positions (c,) [m] over time; [N/m], [N s/m], [N]."""
        self._course, self._stiffness, self._damping = course, stiffness, damping
        self._strength = strength
        self.gripping = True
        self._handle = list(course.at(0.0)[0])
        self._own: list[float] | None = None

    def take(self) -> None:
        """A person leads it from now on: it wants to stay where the handle is."""
        if self._own is None:
            self._own = list(self._handle)

    def push(self, direction: Sequence[float]) -> None:
        """Once taken, pull the handle gently in a direction (c,)."""
        if self._own:
            _pushed(self._own, self._handle, direction, self._stiffness)

    def lead(self, place: Sequence[float]) -> None:
        """Once taken, want the handle at a place [m], of which it takes the first c coordinates."""
        if self._own:
            self._own[:] = place[: len(self._own)]

    def aim(self, hold: Hold, t: float, position: Sequence[float], rotation: Array | None = None) -> None:
        """Tell its hold, of three rows, where it wants a handle at a position (3,) from time t on.

        However it is turned, ``rotation``, is its own affair.
        """
        self._handle = list(position)
        value, rate = (self._own, STILL) if self._own else self._course.at(t)
        hold.stiffness[0], hold.damping[0] = self._stiffness, self._damping
        hold.strength[0] = self._strength if self.gripping else 0.0
        hold.error[:] = [x - p for x, p in zip(value, position, strict=True)]
        hold.rate[:] = rate

    def force(self, t: float, position: Sequence[float], velocity: Sequence[float]) -> list[float]:
        """Force (c,) [N] at time t on a handle with this position and velocity (c,)."""
        self._handle = list(position)
        if not self.gripping:
            return [0.0] * len(position)
        value, rate = (self._own, [0.0] * len(position)) if self._own else self._course.at(t)
        k, d = self._stiffness, self._damping
        rows = zip(value, position, rate, velocity, strict=True)
        return _saturated([k * (x - p) + d * (dx - v) for x, p, dx, v in rows], self._strength)


def _saturated(vector: list[float], most: float) -> list[float]:
    size = hypot(*vector)
    return vector if size <= most else [x * most / size for x in vector]


def hanging(angles: Sequence[float], rates: Sequence[float]) -> tuple[Array, tuple[float, ...]]:
    """R = Rz(yaw) Ry(pi + tilt) Rz(roll), and its angular velocity; see ``Orientation``.

    The handle's axis points down at tilt 0, is tilted towards the direction opposite to yaw, and roll turns
    about it.
    """
    rotation, omega = np.zeros((3, 3)), ffi.new("double[3]")
    (yaw, tilt, roll), (d_yaw, d_tilt, d_roll) = angles, rates
    lib.hand_hanging([yaw, tilt, roll], [d_yaw, d_tilt, d_roll], pointer(rotation, "double", 3, 3), omega)
    return rotation, tuple(omega)


def turned(first: Array) -> Orientation:
    """Orientations as rotation vectors in B from a first one (3, 3)."""

    def orientation(angles: Sequence[float], rates: Sequence[float]) -> tuple[Array, tuple[float, ...]]:
        vector = np.array(angles)
        # d exp(v) / dt = (J v') x exp(v), with the right Jacobian at -v
        omega = pin.Jexp3(-vector) @ np.array(rates)
        return pin.exp3(vector) @ first, tuple(omega.tolist())

    return orientation
