"""When something that comes and goes is worth a word: once, until it has been gone for a while."""

from __future__ import annotations


class Notice:
    """Watches a magnitude.

    Attributes:
        on: whether it stands.
    """

    def __init__(self, from_: float, until: float, ticks: int) -> None:
        """It begins at a magnitude, and ends once the magnitude was below another for so many ticks."""
        if not 0.0 <= until <= from_:
            raise ValueError(f"{until} is not within 0 and {from_}")
        self._from, self._until, self._ticks = from_, until, ticks
        self._quiet = 0
        self.on = False

    def update(self, magnitude: float) -> bool:
        """Take the magnitude of a tick; whether it has just begun."""
        begins = not self.on and magnitude >= self._from
        if begins:
            self.on = True
        self._quiet = self._quiet + 1 if magnitude < self._until else 0
        if self.on and self._quiet >= self._ticks:
            self.on = False
        return begins
