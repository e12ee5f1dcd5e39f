"""Simulated push buttons."""

from __future__ import annotations

from collections.abc import Sequence

from .dead_man import SLACK
from .node import SimNode


class SimButtons(SimNode):
    """Buttons, pressed and released by whoever simulates a person.

    Attributes:
        pressed: which are, a bit each.
    """

    pressed: int = 0


class ButtonScript:
    """Presses some buttons for some time, again and again."""

    def __init__(self, buttons: SimButtons, presses: Sequence[tuple[int, float, float]]) -> None:
        """Bits, and from when to when they are pressed [s]."""
        self._buttons, self._presses = buttons, presses

    def advance(self, time: float) -> None:
        """What is pressed at plant time [s]."""
        pressed = 0
        for bits, begin, end in self._presses:
            if begin - SLACK <= time < end - SLACK:
                pressed |= bits
        self._buttons.pressed = pressed
