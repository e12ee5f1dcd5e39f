"""What a body is made of: the force and the energy of a depth, and what is harder somewhere in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

ENTRY = 1e-3
"""Depth over which damping sets in [m]: a hand that touches fast feels no step."""


@dataclass(frozen=True, slots=True)
class Spot:
    """Somewhere a body is harder or softer: a tumour, a hole.

    Attributes:
        point: its middle, (m,) [m]; radius: where it ends [m].
        factor: of the stiffness in its middle, above 0.
    """

    point: Sequence[float]
    radius: float
    factor: float

    def factor_at(self, x: Sequence[float]) -> tuple[float, list[float]]:
        """The factor at a place (m,), 1 outside, and its gradient (m,)."""
        away = [p - c for p, c in zip(x, self.point, strict=True)]
        left = 1.0 - sum(a * a for a in away) / (self.radius * self.radius)
        if left <= 0.0:
            return 1.0, [0.0] * len(away)
        slope = -4.0 * (self.factor - 1.0) * left / (self.radius * self.radius)
        return 1.0 + (self.factor - 1.0) * left * left, [slope * a for a in away]


class Tissue:
    """Stiffness by depth, and damping that only dissipates."""

    def __init__(
        self,
        stiffness: float,
        damping: float = 0.0,
        layers: Sequence[tuple[float, float]] = (),
        spots: Sequence[Spot] = (),
    ) -> None:
        """What it is made of.

        Args:
            stiffness: below all layers [N/m].
            damping: against the hand's motion along the gradient of the depth [N s/m].
            layers: thickness [m] and stiffness [N/m] of each, from the surface.
            spots: where it is harder.
        """
        self.damping, self.spots = damping, tuple(spots)
        self._tops: list[tuple[float, float, float, float]] = []
        top = force = energy = 0.0
        for thickness, k in (*layers, (0.0, stiffness)):
            self._tops.append((top, k, force, energy))
            energy += (force + 0.5 * k * thickness) * thickness
            force += k * thickness
            top += thickness

    def press(self, depth: float) -> tuple[float, float]:
        """Force [N] and stored energy [J] at a depth of at least 0 [m], without damping and spots."""
        for top, k, force, energy in reversed(self._tops):
            if depth >= top:
                deeper = depth - top
                return force + k * deeper, energy + force * deeper + 0.5 * k * deeper * deeper
        return 0.0, 0.0

    def drag(self, depth: float, rate: float) -> float:
        """Damping force at a depth [m] that grows at a rate [m/s], [N]."""
        return self.damping * min(depth / ENTRY, 1.0) * rate
