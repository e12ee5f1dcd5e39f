"""The wrench that moves a twin, a little ahead of the measured one.

What is measured is a tick old, and the handle follows the twin by springs and filters: a mass that is felt
late gives energy to the hand. Foretold is F + T F', with F' filtered by a low-pass: below its frequency the
wrench comes T earlier, above it is larger by the share 2 pi f T, and so is its noise.
"""

from __future__ import annotations

from math import exp, pi

import numpy as np

from ..models import Array

FILTER = 10.0
"""Hands move nothing on purpose above it [Hz]."""


class HandleLead:
    """Foretells the operator's wrench.

    Attributes:
        wrench: foretold, (6,) [N, N m].
    """

    def __init__(self, dt: float, ahead: float) -> None:
        """Ticks of dt, so far ahead [s]."""
        self._share = 2.0 * pi * FILTER * ahead
        self._keep = exp(-2.0 * pi * FILTER * dt)
        self._below, self.wrench = np.zeros(6), np.zeros(6)

    def reset(self) -> None:
        """Nobody pulls."""
        self._below[:] = self.wrench[:] = 0.0

    def update(self, wrench: Array) -> None:
        """Take the wrench of a tick, (6,) [N, N m]."""
        above = self._keep * (wrench - self._below)
        self._below[:] = wrench - above
        np.add(wrench, self._share * above, out=self.wrench)
