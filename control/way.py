"""A way of joints from one place to another, at rest at both ends: all arrive at once, none jerks."""

from __future__ import annotations

import numpy as np

from ..models import Array

PEAK_SPEED, PEAK_ACCELERATION = 15.0 / 8.0, 10.0 / 3.0**0.5
"""Of s(t) = 10 t^3 - 15 t^4 + 6 t^5 from 0 to 1 in a unit of time: s'(1/2), and s'' where s''' is 0."""


class Way:
    """The polynomial of fifth order along a straight line, as fast as speed and acceleration allow.

    Attributes:
        q, qd, qdd: of this tick, (m,) each [rad or m, s].
    """

    def __init__(self, velocity: Array, acceleration: Array, dt: float) -> None:
        """Most of each joint, (m,) each, and the period [s]."""
        self._velocity, self._acceleration, self._dt = velocity, acceleration, dt
        m = len(velocity)
        self.q, self.qd, self.qdd = np.zeros(m), np.zeros(m), np.zeros(m)
        self._from, self._step = np.zeros(m), np.zeros(m)
        self._ticks = self._tick = 0

    @property
    def arrived(self) -> bool:
        """Whether it is at its end."""
        return self._tick >= self._ticks

    def rest(self, q: Array) -> None:
        """Be at rest at a place (m,)."""
        self.q[:], self.qd[:], self.qdd[:] = q, 0.0, 0.0
        self._ticks = self._tick = 0

    def go(self, q: Array) -> None:
        """Leave the place where it is at rest for another (m,)."""
        self._from[:], self._step[:] = self.q, q - self.q
        self._ticks, self._tick = self._duration(), 0

    def advance(self) -> None:
        """One period along."""
        if self.arrived:
            return
        self._tick += 1
        T, t = self._ticks * self._dt, self._tick / self._ticks
        self.q[:] = self._from + self._step * (t**3 * (10.0 - 15.0 * t + 6.0 * t * t))
        self.qd[:] = self._step * (30.0 * t * t * (1.0 - t) ** 2 / T)
        self.qdd[:] = self._step * (60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / T**2)

    def _duration(self) -> int:
        """Ticks that it takes at least."""
        far = np.abs(self._step)
        fast = PEAK_SPEED * far / self._velocity
        sharp = np.sqrt(PEAK_ACCELERATION * far / self._acceleration)
        return int(np.ceil(max(fast.max(), sharp.max()) / self._dt))
