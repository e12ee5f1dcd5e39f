"""What of the operator's wrench moves the twin, and what of it the joints hold against."""

from __future__ import annotations

import numpy as np

from ..binding import bind, pointer
from ..models import Array
from ._kernels import ffi, lib


class SharedWrench:
    """Two shares of a wrench.

    Attributes:
        felt: what moves the twin, (6,) [N, N m].
        held: what the joints hold against, (6,) [N, N m].
    """

    def __init__(self) -> None:
        self.felt, self.held = np.zeros(6), np.zeros(6)
        self._core = ffi.new("shared_wrench *")
        bind(lib, self._core, felt=self.felt, held=self.held)
        self._wrench: Array | None = None
        self._pointer: object = None

    def take(self, wrench: Array, felt: float, held: float) -> None:
        """Both shares, 0 to 1 each, of a wrench (6,) [N, N m]."""
        if wrench is not self._wrench:  # bound once: it always comes in the same array
            self._wrench, self._pointer = wrench, pointer(wrench, "const double", 6, name="wrench")
        lib.shared_wrench_take(self._core, self._pointer, felt, held)
