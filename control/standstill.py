"""When measured axes stand still."""

from __future__ import annotations

from collections.abc import Sequence


class Standstill:
    """Whether axes are slow, and have been for a while: one that turns round is slow for a moment, too."""

    def __init__(self, speed: Sequence[float], ticks: int) -> None:
        """Speeds below which an axis stands, one each [rad/s or m/s], and for how many ticks it must."""
        self._speed, self._needed, self._slow = tuple(speed), ticks, 0

    def reset(self) -> None:
        """The axes move."""
        self._slow = 0

    def update(self, velocity: Sequence[float], ignored: Sequence[bool]) -> bool:
        """Take the measured velocities of a tick, one each; those that are ignored do not count."""
        rows = zip(velocity, self._speed, ignored, strict=True)
        slow = all(skip or abs(v) < most for v, most, skip in rows)
        self._slow = self._slow + 1 if slow else 0
        return self._slow >= self._needed
