"""Keeps the loop's grid in a fixed phase to the clock of the bus."""

from __future__ import annotations

PROPORTIONAL, INTEGRAL = 0.02, 1e-4
"""Per tick. A stamp jitters by tens of microseconds, a quartz drifts by less than 0.1 us a tick: a slow loop
(damping 1, time constant 100 ticks) averages the first and follows the second."""
LARGEST_SHARE = 0.02
"""Share of the period by which one tick may be moved, so that ticks stay about dt apart."""
LARGEST_DRIFT = 500e-6
"""Between the two clocks."""
LOCKED_SHARE, UNLOCKED_SHARE = 0.1, 0.25
"""Mean phase error in shares of the period, below which the loop counts as locked, and above which no longer.
What lies between, such as stamps that a busy host delays, makes no news."""
MEAN_TICKS = 50.0
LOST_TICKS = 100
"""Without a stamp until the lock counts as lost; meanwhile and afterwards the drift is held."""


class PhaseLock:
    """A digital phase-locked loop: each tick comes half a period after a stamp of the bus clock.

    Half a period is as far from both neighbouring stamps as possible.

    Attributes:
        locked: whether ticks follow the bus.
        error_ns: from the tick to where it should have been.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._drift_ns = 0.0
        self._mean_ns = float(period_ns)
        self._missing = 0
        self.locked = False
        self.error_ns = 0.0

    def update(self, deadline_ns: int, stamp_ns: int) -> int:
        """By how much the grid is to be moved [ns].

        Args:
            deadline_ns: of the present tick.
            stamp_ns: when the last stamp arrived, 0 where none came since the last tick.
        """
        period = self._period_ns
        if stamp_ns == 0:
            self._missing += 1
            self.locked = self.locked and self._missing < LOST_TICKS
            return round(self._drift_ns)
        self._missing = 0
        error = (stamp_ns + period // 2 - deadline_ns + period // 2) % period - period // 2
        self.error_ns = error
        self._mean_ns += (abs(error) - self._mean_ns) / MEAN_TICKS
        self.locked = self._mean_ns < (UNLOCKED_SHARE if self.locked else LOCKED_SHARE) * period
        most = LARGEST_DRIFT * period
        self._drift_ns = min(max(self._drift_ns + INTEGRAL * error, -most), most)
        most = LARGEST_SHARE * period
        return round(min(max(PROPORTIONAL * error + self._drift_ns, -most), most))
