"""Standstill: axes that should stand are watched, not believed (SOS of IEC 61800-5-2)."""

from __future__ import annotations

from collections.abc import Sequence

PATIENCE = 3
"""Ticks in a row that prove rest or motion: one bad sample proves neither."""


class Standstill:
    """Remembers where axes came to stand, and says which of them left.

    It begins to watch once they are at rest, and at the latest some ticks after it was started: brakes
    need time to catch what moves.
    """

    def __init__(self, play: Sequence[float], settling: int) -> None:
        """Binds the bounds.

        Args:
            play: how far each axis may be from where it stood [rad or m].
            settling: ticks from ``start`` until the axes must stand.
        """
        self._play, self._settling = play, settling
        self._left = self._resting = self._beyond = 0
        self._stood: Sequence[float] = ()

    def start(self) -> None:
        """The axes are to stand from now on, wherever they come to rest."""
        self._left, self._resting, self._beyond = self._settling, 0, 0
        self._stood = ()

    def moved(self, position: Sequence[float], at_rest: bool) -> int:
        """Which axis left its place, -1 where all stand; call once a tick with what is measured.

        Args:
            position: of the axes [rad or m]; one that is no number has left.
            at_rest: whether all of them are slow enough to stand.
        """
        if self._left > 0:
            self._resting = self._resting + 1 if at_rest else 0
            self._left = 0 if self._resting == PATIENCE else self._left - 1
            return -1
        if not self._stood:
            self._stood = tuple(position)
        axis = strayed(position, self._stood, self._play)
        self._beyond = self._beyond + 1 if axis >= 0 else 0
        return axis if self._beyond >= PATIENCE else -1


def strayed(position: Sequence[float], place: Sequence[float], play: Sequence[float]) -> int:
    """The first axis that is further from its place than its play, -1 where none is."""
    for axis, (q, stood, most) in enumerate(zip(position, place, play, strict=True)):
        if not abs(q - stood) <= most:
            return axis
    return -1
