"""A sensor that smooths by itself and samples more slowly than the bus asks."""

from __future__ import annotations

from math import exp, pi

import numpy as np

from ..models import Array


class Smoothed:
    """First-order low-pass behind what is felt, of which every so many periods a sample is held.

    Attributes:
        value: as the sensor reports it, (n,).
    """

    def __init__(self, n: int, cutoff: float, periods: int) -> None:
        """Cut-off frequency [Hz]; periods from sample to sample."""
        self.value, self._state = np.zeros(n), np.zeros(n)
        self._cutoff, self._periods, self._count = cutoff, periods, 0
        self._fresh = True

    def take(self, felt: Array, dt: float) -> Array:
        """What is felt (n,) for another dt [s]; at first it has been so for ever."""
        if self._fresh:
            self._state[:], self._fresh = felt, False
        self._state += (1.0 - exp(-2.0 * pi * self._cutoff * dt)) * (felt - self._state)
        if self._count % self._periods == 0:
            self.value[:] = self._state
        self._count += 1
        return self.value
