"""Simulated people's fingers on dead-man switches."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from .person import Switch
from .safety_plc import SimSafetyPlc

SLACK = 1e-9
"""In comparing times that are sums of periods [s]."""


class DeadManScript:
    """Presses and releases both channels of a switch at given times."""

    def __init__(self, plc: SimSafetyPlc, switch: Switch, changes: Sequence[tuple[float, bool]]) -> None:
        """Times [s] and whether the switch is pressed from then on."""
        self._plc, self._switch, self._changes = plc, switch, deque(sorted(changes))

    def let_go(self) -> None:
        """Change nothing from now on: somebody else holds the switch."""
        self._changes.clear()

    def advance(self, time: float) -> None:
        """Act on what has come due at plant time [s]."""
        while self._changes and time >= self._changes[0][0] - SLACK:
            self._plc.turn(self._switch, self._changes.popleft()[1])
