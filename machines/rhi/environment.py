"""Virtual environments that an impedance-type interface renders."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot


class Wall:
    """A spring behind a plane: F = -k d n at depth d > 0, ContactAware, (21) on its stiff side.

    Attributes:
        depth: of the hand behind the plane at the last ``force``, 0 in front of it [m].
    """

    def __init__(self, point: Sequence[float], normal: Sequence[float], stiffness: float) -> None:
        """A point of the plane (m,) [m], the direction into the wall (m,), stiffness [N/m]."""
        length = hypot(*normal)
        self._normal = [x / length for x in normal]
        self._offset = sum(n * p for n, p in zip(self._normal, point, strict=True))
        self._stiffness = stiffness
        self.depth = 0.0

    @property
    def energy(self) -> float:
        """What the spring stores at ``depth`` [J]."""
        return 0.5 * self._stiffness * self.depth * self.depth

    @property
    def normal(self) -> list[float]:
        """Unit vector into the wall, (m,)."""
        return self._normal

    def force(self, position: Sequence[float]) -> list[float]:
        """Force on the hand at a position (m,) [m], (m,) [N]."""
        along = sum(n * x for n, x in zip(self._normal, position, strict=True)) - self._offset
        self.depth = max(along, 0.0)
        return [-self._stiffness * self.depth * n for n in self._normal]
