"""Actuator saturation controller: from the free to the stiff ellipsoid and back (ContactAware, (15)-(19))."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi


@dataclass(frozen=True, slots=True)
class Thresholds:
    """Reserves V below which the stiff and above which the free ellipsoid is wanted, ``leave < come_back``.

    Raises:
        ValueError: thresholds that would chatter.
    """

    leave: float
    come_back: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.leave < self.come_back <= 1.0:
            raise ValueError(
                f"eps1 = {self.leave:g} and eps2 = {self.come_back:g}; hysteresis needs 0 <= eps1 < eps2 <= 1"
            )


class Transition:
    """Activation Omega, 1 for free and 0 for stiff, with a latched direction.

    The phase runs from 0 (free) to 1 (stiff) and Omega = (1 + cos(pi phase)) / 2: forwards that is (17),
    backwards (18). A reversal on the way turns the phase around where it is, so Omega never jumps.

    Two things are beyond the paper. The less the reserve, the sooner force is missing, and the faster the
    phase runs. And contact that has ended may come again, so the way back waits: taps would otherwise
    each find the posture where the one before found it.

    Attributes:
        stiff: the latched direction.
        phase: 0 to 1.
        haste: how many times faster than (19) it goes.
        changes: how often the direction changed.
    """

    def __init__(self, thresholds: Thresholds, dt: float, linger: float = 0.0, urgency: float = 1.0) -> None:
        """Thresholds, dt of a tick [s], linger: how long the way back waits [s], urgency: the most haste."""
        self._thresholds, self._dt, self._urgency = thresholds, dt, urgency
        self._waits = round(linger / dt)
        self._frozen = False
        self.reset()

    def reset(self) -> None:
        """Free."""
        if not self._frozen:
            self.stiff, self.phase, self.haste = False, 0.0, 1.0
            self.changes = self._waited = 0

    def freeze(self, phase: float) -> None:
        """Stay at a phase: 0 for the free, 1 for the stiff ellipsoid throughout."""
        self.phase, self.stiff, self.haste, self._frozen = phase, phase > 0.0, 1.0, True

    @property
    def omega(self) -> float:
        """Activation of the free ellipsoid."""
        return 0.5 * (1.0 + cos(pi * self.phase))

    @property
    def turning(self) -> bool:
        """On the way to the ellipsoid for contact."""
        return self.stiff and 0.0 < self.phase < 1.0

    def update(self, here: float, in_free: float, duration: float) -> float:
        """Omega of this tick.

        Args:
            here: reserve V in the present posture.
            in_free: reserve that the same force would leave in the free posture. In the stiff posture V can
                be above the return threshold while the hand is still loaded.
            duration: of a whole transition, (19) [s]; 0 jumps.
        """
        if self._frozen:
            return self.omega
        wanted = self._held_back(in_free) if self.stiff else here < self._thresholds.leave
        if wanted != self.stiff:
            self.stiff = wanted
            self.changes += 1
        step = self._dt / duration if duration > self._dt else 1.0
        lack = max(0.0, 1.0 - here / self._thresholds.leave) if self.stiff else 0.0
        self.haste = 1.0 + (self._urgency - 1.0) * lack
        if self.stiff:
            self.phase = min(1.0, self.phase + step * self.haste)
        else:
            self.phase = max(0.0, self.phase - step)
        return self.omega

    def _held_back(self, in_free: float) -> bool:
        """Whether the hand is still loaded, or was until a moment ago."""
        self._waited = self._waited + 1 if in_free > self._thresholds.come_back else 0
        return self._waited <= self._waits
