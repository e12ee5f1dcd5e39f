"""Passivity of a rendered twin at the handle: an observer of what the machine gives, and damping for it.

A twin is passive; the handle that renders it lags behind, and a mass that is felt late gives energy to the
hand. What the hand gets beyond what the twin, its springs included, gives back is the work of its force over
the way of the handle from the twin. It is looked at in the band in which handles tremble, where no person
moves on purpose, and per square of the twin's speed there, so that a small tremble counts like a large one: a
resistance that the machine lacks. Beyond what is allowed the twin is damped by as much, in that band alone:
slow motion feels of a damper d no more than a mass of d / (10 pi Hz). The damping goes slowly, or what
trembled would begin anew.

Observer and controller are those of time-domain passivity (Hannaford and Ryu 2002), with an observer that
forgets, and a controller that spends what is missing over a while instead of in a sample.
"""

from __future__ import annotations

from math import exp, pi

import numpy as np

from ..models import Array

BAND = 5.0, 40.0
"""Above the first frequency handles tremble, and no person moves on purpose; above the second there is noise
[Hz]."""
MEMORY_S, ATTACK_S, RELEASE_S = 0.15, 0.05, 3.0
"""Time constants: of the averages of work and squared speed; with which damping comes, and goes [s]."""
STILL = 5e-4, 5e-3
"""Speeds below which nothing trembles but noise [m/s], [rad/s]."""
ALLOWED = 10.0, 0.3
"""Resistance that a machine may lack [N s/m], [N m s/rad]: twins have some, and hands."""
MOST = 100.0, 3.0
"""Most that is added [N s/m], [N m s/rad]."""


class HandlePassivity:
    """Observes translation and rotation of a handle apart, and damps the twin.

    Attributes:
        lack: resistance that the machine takes away from the twin, (2,) [N s/m], [N m s/rad].
        damping: of the twin in its place, (2,) [N s/m], [N m s/rad].
        wrench: of that damping on the twin, (6,) [N, N m].
    """

    def __init__(self, dt: float) -> None:
        """Ticks of dt [s]."""
        self._dt = dt
        self._attack, self._release = (1.0 - exp(-dt / t) for t in (ATTACK_S, RELEASE_S))
        self._slow, self._fast = (1.0 - exp(-2.0 * pi * f * dt) for f in BAND)
        self._forget = 1.0 - exp(-dt / MEMORY_S)
        self._still, self._allowed, self._most = np.square(STILL), np.array(ALLOWED), np.array(MOST)
        self._below, self._band, self._ahead = np.zeros((3, 6)), np.zeros((3, 6)), np.zeros(6)
        self._given, self._square = np.zeros(2), np.zeros(2)
        self.lack, self.damping, self.wrench = np.zeros(2), np.zeros(2), np.zeros(6)
        self._fresh = True

    def reset(self) -> None:
        """Nothing trembles yet."""
        for array in (self._band, self._given, self._square, self.lack, self.damping, self.wrench):
            array[:] = 0.0
        self._fresh = True

    def update(self, wrench: Array, twist: Array, ahead: Array) -> None:
        """Take a tick.

        Args:
            wrench: of the operator that moves the twin, (6,) [N, N m].
            twist: of the twin, (6,) [m/s, rad/s].
            ahead: from the twin to the measured handle: translation and rotation vector, (6,) [m, rad].
        """
        if self._fresh:
            self._ahead[:] = ahead
        seen = np.array((wrench, twist, (ahead - self._ahead) / self._dt))
        self._ahead[:] = ahead
        self._below += (1.0 if self._fresh else self._slow) * (seen - self._below)
        self._fresh = False
        above = seen - self._below
        self._band += self._fast * (above - self._band)
        force, speed, away = self._band.reshape(3, 2, 3)
        self._given -= self._forget * ((force * away).sum(1) + self._given)
        self._square += self._forget * ((speed * speed).sum(1) - self._square)
        np.divide(self._given, self._square + self._still, out=self.lack)
        change = np.clip(self.lack - self._allowed, 0.0, self._most) - self.damping
        self.damping += np.where(change > 0.0, self._attack, self._release) * change
        np.multiply(-self.damping[:, None], above[1].reshape(2, 3), out=self.wrench.reshape(2, 3))
