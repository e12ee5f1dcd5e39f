"""The wrench that moves a twin, a little ahead of the measured one.

What is measured is a tick old, and the handle follows the twin by springs and filters: a mass that is felt
late gives energy to the hand. Foretold is F + T F', with F' filtered by a low-pass: below its frequency the
wrench comes T earlier, above it is larger by the share 2 pi f T, and so is its noise.
"""

from __future__ import annotations

from math import exp, pi

import numpy as np

from ..binding import bind, pointer
from ..models import Array
from ._kernels import ffi, lib

FILTER = 10.0
"""Hands move nothing on purpose above it [Hz]."""


class HandleLead:
    """Foretells the operator's wrench.

    Attributes:
        wrench: foretold, (6,) [N, N m].
    """

    def __init__(self, dt: float, ahead: float) -> None:
        """Ticks of dt, so far ahead [s]."""
        self._below, self.wrench = np.zeros(6), np.zeros(6)
        share, keep = 2.0 * pi * FILTER * ahead, exp(-2.0 * pi * FILTER * dt)
        self._core = ffi.new("handle_lead *", {"share": share, "keep": keep})
        bind(lib, self._core, below=self._below, wrench=self.wrench)
        self._taken: Array | None = None
        self._pointer: object = None

    def reset(self) -> None:
        """Nobody pulls."""
        self._below[:] = self.wrench[:] = 0.0

    def update(self, wrench: Array) -> None:
        """Take the wrench of a tick, (6,) [N, N m]."""
        if wrench is not self._taken:  # bound once: it always comes in the same array
            self._taken, self._pointer = wrench, pointer(wrench, "const double", 6, name="wrench")
        lib.handle_lead_update(self._core, self._pointer)
