"""Force fields of rehabilitation (ContactAware, I): help towards a place, and resistance to motion."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

from .shapes import Shape


class Assist:
    """Pulls the hand towards a place with a constant force, less and less within ``soft`` of it.

    U = f (sqrt(r^2 + s^2) - s) at a distance r. It is stored energy that nobody has put in: the share of the
    force that is rendered is kept passive beyond what the field holds when the machine engages.
    """

    def __init__(self, point: Sequence[float], force: float, soft: float) -> None:
        """The place (m,) [m], the force far away [N], how soft it is there [m]."""
        self.shape: Shape | None = None
        self._point, self._force, self._soft = list(point), force, soft
        self.depth = self.energy = 0.0

    def force(self, x: Sequence[float], v: Sequence[float]) -> list[float] | None:
        """See ``Rendered``."""
        away = [p - a for p, a in zip(self._point, x, strict=True)]
        far = sqrt(sum(a * a for a in away) + self._soft * self._soft)
        self.energy = self._force * (far - self._soft)
        return [self._force * a / far for a in away]


class Resist:
    """Resists every motion within a distance of a place, and nothing beyond: F = -b(r) v."""

    def __init__(self, point: Sequence[float], radius: float, damping: float) -> None:
        """The place (m,) [m], where it ends [m], b in its middle [N s/m]."""
        self.shape: Shape | None = None
        self._point, self._radius, self._damping = list(point), radius, damping
        self.depth = self.energy = 0.0

    def force(self, x: Sequence[float], v: Sequence[float]) -> list[float] | None:
        """See ``Rendered``."""
        left = 1.0 - sum((p - a) ** 2 for p, a in zip(self._point, x, strict=True)) / self._radius**2
        if left <= 0.0:
            return None
        b = self._damping * min(1.0, 4.0 * left)
        return [-b * u for u in v]
