"""Commands that reach the motors later than the wire brings them."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from ..models import Array


class Delay:
    """Holds the commands of n drives back for some ticks; what a drive switches off is off at once."""

    def __init__(self, ticks: int, n: int) -> None:
        self._late = deque(np.zeros(n) for _ in range(ticks))

    def __call__(self, command: Array, off: NDArray[np.bool_]) -> Array:
        """What drives do now, (n,), when they are told a command (n,) and some of them are off."""
        if not self._late:
            return command
        self._late.append(command.copy())
        late = self._late.popleft()
        late[off] = 0.0
        return late
