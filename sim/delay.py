"""Commands that reach the motors later than the wire brings them."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence


class Delay:
    """Holds the commands of n drives back for some ticks; what a drive switches off is off at once."""

    def __init__(self, ticks: int, n: int) -> None:
        self._late: deque[Sequence[float]] = deque([[0.0] * n] * ticks)

    def __call__(self, command: Sequence[float], off: Sequence[bool]) -> Sequence[float]:
        """What drives do now, (n,), when they are told a command (n,) and some of them are off."""
        if not self._late:
            return command
        self._late.append(command)
        return [0.0 if dead else late for late, dead in zip(self._late.popleft(), off, strict=True)]
