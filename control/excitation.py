"""Motion that tells the parameters of a model apart: sums of sines of all joints, well conditioned.

Finite Fourier series whose coefficients are chosen by the condition of the regressor they lead to (Swevers).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from ..models import Array

HARMONICS = np.array([1.0, 2.0, 3.0, 5.0, 7.0, 11.0])
"""Frequencies of the sines, in multiples of the lowest."""
LOWEST = 0.1
"""[Hz]; the course repeats after ten seconds."""
EASE_S = 2.0
"""In so long it is eased in from rest, and out to rest [s]."""
SAMPLES_HZ = 20.0
"""A course is judged by so many places a second."""
DRAWS, REFINEMENTS = 24, 40
"""Random courses, and changes of the best of them that are tried."""
CHANGE = 0.25
"""Size of such a change, as a share of the coefficients."""
SHRINK, SHRINKINGS = 0.85, 18
"""A course that leaves the limits is made smaller in such steps."""


class Excitation:
    """Sums of sines about a centre, from rest there and back to it; see ``Course``.

    Attributes:
        q, qd, qdd: of this tick, (m,) each [rad or m, s].
    """

    def __init__(
        self, centre: Array, waves: Array, seconds: float, dt: float, frequency: Array = LOWEST * HARMONICS
    ) -> None:
        """Begin at rest.

        Args:
            centre: of the sines, (m,) [rad or m].
            waves: amplitudes of sines and cosines, (2, h, m).
            seconds: from rest to rest [s].
            dt: of a tick [s].
            frequency: of the sines, (h,) [Hz].
        """
        self.centre, self.waves, self.seconds, self.dt = centre, waves, seconds, dt
        self.q, self.qd, self.qdd = centre.copy(), np.zeros(len(centre)), np.zeros(len(centre))
        self._w = 2.0 * pi * frequency
        self._tick, self._ticks = 0, round(seconds / dt)

    @property
    def arrived(self) -> bool:
        """Whether it is at its end."""
        return self._tick >= self._ticks

    def advance(self) -> None:
        """One period along."""
        if self.arrived:
            return
        self._tick += 1
        (self.q[:],), (self.qd[:],), (self.qdd[:],) = self.at(np.array([self._tick * self.dt]))

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Places, speeds and accelerations at times (k,) [s], (k, m) each."""
        w = self._w
        sine, cosine = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
        a, b = self.waves
        x = sine @ a + cosine @ b
        xd = (cosine * w) @ a - (sine * w) @ b
        xdd = -(sine * w * w) @ a - (cosine * w * w) @ b
        e, ed, edd = (part[:, None] for part in _eased(t, self.seconds))
        return self.centre + e * x, ed * x + e * xd, edd * x + 2.0 * ed * xd + e * xdd


def _eased(t: Array, seconds: float) -> tuple[Array, Array, Array]:
    """From 0 to 1 and back to 0, with its derivatives: polynomials of fifth order at both ends, (k,) each."""
    near = np.minimum(t, seconds - t)
    s = np.clip(near / EASE_S, 0.0, 1.0)
    way = np.where(t <= 0.5 * seconds, 1.0, -1.0)
    rate = way * 30.0 * s**2 * (1.0 - s) ** 2 / EASE_S
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s), rate, 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / EASE_S**2


@dataclass(frozen=True, slots=True)
class Room:
    """What a course must keep to.

    Attributes:
        lower, upper: of the joints, (m,), infinite where there is no limit [rad or m].
        velocity, acceleration: largest, (m,).
        reached: whether the joints get from where they are to a place (m,).
        fits: whether places, speeds and accelerations (k, m) keep to everything else.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    reached: Callable[[Array], bool]
    fits: Callable[[Array, Array, Array], bool]


def design(
    start: Array,
    room: Room,
    rows: Callable[[Array, Array, Array], Array],
    seconds: float,
    seed: int,
    dt: float,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> tuple[Excitation, float] | None:
    """The best conditioned of many courses and of many small changes of the best of them.

    Args:
        start: where the joints are, (m,) [rad or m].
        room: what the course keeps to.
        rows: what parameters are multiplied by at places, speeds and accelerations (k, m): (k m, p).
        seconds: of the course, more than twice ``EASE_S``.
        seed: of the courses.
        dt: of a tick [s].
        progress: told how many were tried, and of how many.

    Returns:
        The course and its condition number; None where not even a small one fits.
    """
    rng, t = np.random.default_rng(seed), np.arange(0.0, seconds, 1.0 / SAMPLES_HZ)
    finite = np.isfinite(room.lower) & np.isfinite(room.upper)
    middle = start.copy()
    middle[finite] = 0.5 * (room.lower[finite] + room.upper[finite])
    best: tuple[Excitation, float] | None = None
    for k in range(DRAWS + REFINEMENTS):
        progress(k, DRAWS + REFINEMENTS)
        if k < DRAWS or best is None:
            centre = start + rng.uniform(-0.2, 1.0, len(start)) * (middle - start)
            waves = rng.standard_normal((2, len(HARMONICS), len(start)))
        else:
            known = best[0]
            size = np.abs(known.waves).max(axis=(0, 1))
            centre = known.centre + CHANGE * rng.standard_normal(len(start)) * size
            waves = known.waves + CHANGE * rng.standard_normal(known.waves.shape) * size
        course = _fitted(Excitation(centre, waves, seconds, dt), room, t)
        if course is None:
            continue
        judged = condition(rows(*course.at(t)))
        if best is None or judged < best[1]:
            best = course, judged
    return best


def condition(rows: Array) -> float:
    """Condition number of a regressor whose columns are scaled to length 1."""
    size = np.linalg.norm(rows, axis=0)
    if not size.all():
        return float("inf")
    values = np.linalg.svd(rows / size, compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0.0 else float("inf")


def _fitted(course: Excitation, room: Room, t: Array) -> Excitation | None:
    """As large as each joint's limits allow, and then as small as everything else asks."""
    centre = course.centre
    if not ((centre > room.lower) & (centre < room.upper)).all() or not room.reached(centre):
        return None
    waves = course.waves * _share(course, room, t)
    for _ in range(SHRINKINGS):
        smaller = Excitation(centre, waves, course.seconds, course.dt)
        q, qd, qdd = smaller.at(t)
        inside = (q >= room.lower).all() and (q <= room.upper).all()
        slow = (np.abs(qd) <= room.velocity).all() and (np.abs(qdd) <= room.acceleration).all()
        if inside and slow and room.fits(q, qd, qdd):
            return smaller
        waves = SHRINK * waves
    return None


def _share(course: Excitation, room: Room, t: Array) -> Array:
    """By how much each joint's sines may be larger, (m,)."""
    q, qd, qdd = course.at(t)
    x, v, a = (np.abs(part).max(axis=0) for part in (q - course.centre, qd, qdd))
    way = np.minimum(np.minimum(room.upper - course.centre, course.centre - room.lower), pi)
    share: Array = np.minimum.reduce([way / x, room.velocity / v, room.acceleration / a])
    return share
