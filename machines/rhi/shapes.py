"""Shapes of bodies: how deep a place is in them, and which way is deeper.

A depth is C1 inside its body: the force that grows with it is continuous wherever the hand goes, and
conservative. It is the distance to the surface wherever one part of the surface is clearly the nearest.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot, inf, log
from typing import Protocol

import numpy as np

from ...models import Array

CORE = 0.25
"""Part of a sphere's radius within which the depth is rounded: its centre has no direction."""


class Shape(Protocol):
    """Where a body is.

    Attributes:
        deepest: the most that a place in it is deep, about [m].
    """

    deepest: float

    def depth(self, x: Sequence[float]) -> tuple[float, list[float]]:
        """Depth of a place (m,) [m], negative outside, and its gradient (m,), no longer than 1."""


class Plane:
    """Everything behind a plane."""

    deepest = inf

    def __init__(self, point: Sequence[float], normal: Sequence[float]) -> None:
        """A point of the plane (m,) [m] and the direction into it (m,)."""
        length = hypot(*normal)
        self._normal = [x / length for x in normal]
        self._offset = sum(n * p for n, p in zip(self._normal, point, strict=True))

    def depth(self, x: Sequence[float]) -> tuple[float, list[float]]:
        """See ``Shape``."""
        return sum(n * p for n, p in zip(self._normal, x, strict=True)) - self._offset, self._normal


class Sphere:
    """A sphere, or a disc where the task has two directions."""

    def __init__(self, centre: Sequence[float], radius: float) -> None:
        """Centre (m,) [m] and radius [m]."""
        self._centre, self._radius, self._core = list(centre), radius, CORE * radius
        self.deepest = radius - 0.5 * self._core

    def depth(self, x: Sequence[float]) -> tuple[float, list[float]]:
        """See ``Shape``."""
        inwards = [c - p for c, p in zip(self._centre, x, strict=True)]
        away, core = hypot(*inwards), self._core
        if away >= core:
            return self._radius - away, [v / away for v in inwards]
        return self._radius - 0.5 * (away * away / core + core), [v / core for v in inwards]


class Box:
    """A box, or a rectangle, whose edges are round by about ``edge``.

    Of the depths behind its sides a smooth minimum, -w log sum exp(-d / w): no further from the least than w
    times the logarithm of how many are about as small, and exponentially little from a side alone.
    """

    def __init__(self, centre: Sequence[float], size: Sequence[float], axes: Array, edge: float) -> None:
        """Centre (m,) [m], lengths of the sides (m,) [m], their directions as columns (m, m), w [m]."""
        self._normals: list[list[float]] = []
        self._offsets: list[float] = []
        for axis, side in zip(np.asarray(axes, float).T.tolist(), size, strict=True):
            middle = sum(a * c for a, c in zip(axis, centre, strict=True))
            self._normals += [axis, [-a for a in axis]]
            self._offsets += [middle - 0.5 * side, -middle - 0.5 * side]
        self._edge = edge
        self.deepest = self.depth(centre)[0]

    def depth(self, x: Sequence[float]) -> tuple[float, list[float]]:
        """See ``Shape``."""
        w = self._edge
        behind = [
            sum(n * p for n, p in zip(normal, x, strict=True)) - offset
            for normal, offset in zip(self._normals, self._offsets, strict=True)
        ]
        least = min(behind)
        shares = [exp((least - d) / w) for d in behind]
        total = sum(shares)
        gradient = [
            sum(s * n[i] for s, n in zip(shares, self._normals, strict=True)) / total for i in range(len(x))
        ]
        return least - w * log(total), gradient


class Sampled:
    """Depths on a regular grid, smoothed by quadratic B-splines: flat sides stay exact, edges become round.

    The splines keep linear functions as they are, and depth and gradient belong together, so that the force
    that follows from them is conservative.
    """

    def __init__(self, origin: Sequence[float], cell: float, depths: Array) -> None:
        """The first node (m,) [m], distance of nodes [m], depth at each of them [m], m-dimensional."""
        self._origin, self._cell, self._depths = list(origin), cell, np.ascontiguousarray(depths, float)
        self._last = [n - 2 for n in self._depths.shape]
        self._nothing = [0.0] * self._depths.ndim
        self.deepest = float(self._depths.max())

    def depth(self, x: Sequence[float]) -> tuple[float, list[float]]:
        """See ``Shape``; off the grid there is nothing."""
        block, weights, slopes = self._depths, [], []
        window = []
        for p, o, last in zip(x, self._origin, self._last, strict=True):
            at = (p - o) / self._cell
            node = round(at)
            if not 1 <= node <= last:
                return -self._cell, self._nothing
            t = at - node
            weights.append(np.array((0.5 * (0.5 - t) ** 2, 0.75 - t * t, 0.5 * (0.5 + t) ** 2)))
            slopes.append(np.array((t - 0.5, -2.0 * t, t + 0.5)) / self._cell)
            window.append(slice(node - 1, node + 2))
        block = block[tuple(window)]
        gradient = [
            _contract(block, [*weights[:i], slopes[i], *weights[i + 1 :]]) for i in range(len(weights))
        ]
        return _contract(block, weights), gradient


def _contract(block: Array, factors: Sequence[Array]) -> float:
    """Sum of a block of nodes (3, ..., 3) weighted along each axis."""
    for factor in reversed(factors):
        block = block @ factor
    return float(block)
