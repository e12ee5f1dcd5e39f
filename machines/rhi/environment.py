"""Virtual environments that an impedance-type interface renders: bodies that push back, and fields."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Protocol

from .shapes import Shape
from .tissue import Tissue


class Rendered(Protocol):
    """A part of an environment.

    Attributes:
        depth: of the hand in it, 0 where it touches nothing [m].
        energy: that the hand can have back from it [J].
        shape: where its surface is; None without one.
    """

    depth: float
    energy: float
    shape: Shape | None

    def force(self, x: Sequence[float], v: Sequence[float]) -> list[float] | None:
        """On a hand at x with velocity v, (m,) [N]; None where it does nothing."""


class Body:
    """A tissue in a shape: F = -dU/dx of its energy U, and damping that never pulls."""

    def __init__(self, shape: Shape, tissue: Tissue) -> None:
        self.shape: Shape | None = shape
        self._of, self._tissue = shape, tissue
        self.depth = self.energy = 0.0

    def force(self, x: Sequence[float], v: Sequence[float]) -> list[float] | None:
        """See ``Rendered``."""
        depth, gradient = self._of.depth(x)
        if depth <= 0.0:
            self.depth = self.energy = 0.0
            return None
        tissue = self._tissue
        push, energy = tissue.press(depth)
        aside = [0.0] * len(gradient)
        for spot in tissue.spots:
            factor, slope = spot.factor_at(x)
            push, energy = factor * push, factor * energy
            aside = [factor * a for a in aside]
            aside = [a + energy / factor * s for a, s in zip(aside, slope, strict=True)]
        if tissue.damping:
            rate = sum(g * u for g, u in zip(gradient, v, strict=True))
            push = max(0.0, push + tissue.drag(depth, rate))
        self.depth, self.energy = depth, energy
        force = [-push * g for g in gradient]
        return [f - a for f, a in zip(force, aside, strict=True)] if tissue.spots else force


class Environment:
    """Everything that is rendered, at once.

    Attributes:
        parts: of it.
        depth: of the hand in the body in which it is deepest at the last ``force``, 0 in front of all [m].
        energy: what all of them store there [J].
    """

    def __init__(self, parts: Sequence[Rendered]) -> None:
        self.parts = list(parts)
        self.depth = self.energy = 0.0

    def force(self, position: Sequence[float], velocity: Sequence[float] = ()) -> list[float]:
        """Force on the hand at a position (m,) [m] with a velocity (m,) [m/s], (m,) [N]."""
        total: list[float] | None = None
        velocity = velocity or [0.0] * len(position)
        for part in self.parts:
            force = part.force(position, velocity)
            if force is not None:
                total = [a + b for a, b in zip(total, force, strict=True)] if total else force
        self.depth = max([part.depth for part in self.parts], default=0.0)
        self.energy = sum([part.energy for part in self.parts])
        return total if total else [-0.0] * len(position)  # the sign that -k d has in front of a wall

    @property
    def granted(self) -> float:
        """Part of ``energy`` that nobody has put in: that of fields, which have no surface [J]."""
        return sum([part.energy for part in self.parts if part.shape is None])

    def surface(self, x: Sequence[float]) -> tuple[list[float], list[float]] | None:
        """The place of a body's surface next to a place (m,) in it, and the direction into the body there.

        None where the place is in no body.
        """
        for part in self.parts:
            if part.shape and (found := _outwards(part.shape, list(x))):
                return found
        return None


REACHED = 1e-6
"""Distance at which a place is on a surface [m]."""
STEPS = 30


def _outwards(shape: Shape, x: list[float]) -> tuple[list[float], list[float]] | None:
    """By Newton steps along the gradient."""
    depth, gradient = shape.depth(x)
    if depth <= 0.0:
        return None
    for _ in range(STEPS):
        square = sum(g * g for g in gradient)
        if square < 1e-6:
            return None
        x = [p - depth * g / square for p, g in zip(x, gradient, strict=True)]
        depth, gradient = shape.depth(x)
        if abs(depth) < REACHED:
            size = hypot(*gradient)
            return x, [g / size for g in gradient]
    return None
