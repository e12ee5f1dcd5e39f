"""Postures that the interface can turn to with the hand in one place and every motor inside its limits.

Limits divide the self-motion into parts: from one to another there is no way but across a limit, or by
another place of the hand. A target is of use only in the part where the interface is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...models import Array, ModelError
from .guard import Span
from .redundant import RedundantArm
from .self_motion import CLOSED, Bounds, Objective, close, descend, scan

NEIGHBOURS = 12
"""Postures next to one that are tried for a way."""
STRAIGHT = 0.5
"""How far the middle of a way may lie beside the straight line, as a share of half its length."""
LEAST = 20
"""Postures of a part; what is smaller is a crumb of the scan."""
POLISHED = 8
"""How many of the best scanned postures are improved further."""
ROOM = (3.0, 2.0)
"""Distance of targets to the limits, in margins, where a part has such postures: the hand leaves x, too."""
CHUNK = 500


class Parts:
    """The self-motion at x, scanned, in parts that are connected inside the limits.

    Attributes:
        postures: (k, n) [rad]; part: of each, (k,), from 0.
    """

    def __init__(self, arm: RedundantArm, x: Array, bounds: Bounds, count: int) -> None:
        """Scan with so many configurations.

        Raises:
            ModelError: no configuration within the bounds (n,) each [rad] reaches x (m,) [m].
        """
        postures = scan(arm, x, bounds, count)
        if not len(postures):
            raise ModelError(
                "the interface", 0, f"cannot reach {x.tolist()} m", "move the point, widen the limits"
            )
        part = _connected(len(postures), _ways(arm, x, bounds, postures))
        sizes = np.bincount(part)
        keep = sizes[part] >= min(LEAST, int(sizes.max()))
        self.postures: Array = postures[keep]
        self.part: NDArray[np.int64] = np.unique(part[keep], return_inverse=True)[1]

    def of(self, q: Array) -> int:
        """The part of the posture next to q (n,)."""
        return int(self.part[np.argmin(np.linalg.norm(self.postures - q, axis=1))])


class Targets:
    """The best posture of each part, for each of several objectives.

    Attributes:
        parts: of the self-motion.
        best: (parts, objectives, n) [rad].
        cost: of them, (parts, objectives).
    """

    def __init__(
        self, arm: RedundantArm, x: Array, span: Span, objectives: Sequence[Objective], count: int
    ) -> None:
        """Search at x (m,) [m], as far inside the limits as the margin, or as there are postures.

        Raises:
            ModelError: no posture within the limits reaches x.
        """
        bounds = span.inside(span.margin)
        try:
            self.parts = Parts(arm, x, bounds, count)
        except ModelError:
            bounds = span.inside(0.0)
            self.parts = Parts(arm, x, bounds, count)
        J = arm.reach(self.parts.postures)[1]
        number = int(self.parts.part.max()) + 1
        self.best = np.empty((number, len(objectives), arm.n))
        self.cost = np.empty((number, len(objectives)))
        for part in range(number):
            own = np.flatnonzero(self.parts.part == part)
            own, limits = _roomy(self.parts.postures, own, span, bounds)
            for k, objective in enumerate(objectives):
                costs = objective.cost(J[own])
                start = self.parts.postures[own[np.argsort(costs)[:POLISHED]]]
                found, cost = descend(arm, start, x, objective, bounds=limits)
                self.best[part, k], self.cost[part, k] = found[np.argmin(cost)], np.min(cost)

    def reachable(self, q: Array) -> Array:
        """Targets in the part of a posture (n,), (objectives, n)."""
        targets: Array = self.best[self.parts.of(q)]
        return targets


def _roomy(
    postures: Array, own: NDArray[np.int64], span: Span, bounds: Bounds
) -> tuple[NDArray[np.int64], Bounds]:
    """Those of a part's postures that leave the hand most room to move, and the bounds that they keep."""
    for margins in ROOM:
        lower, upper = span.inside(margins * span.margin)
        inside = own[np.all((lower <= postures[own]) & (postures[own] <= upper), axis=1)]
        if len(inside) >= LEAST:
            return inside, (lower, upper)
    return own, bounds


def _ways(arm: RedundantArm, x: Array, bounds: Bounds, postures: Array) -> NDArray[np.int64]:
    """Pairs (w, 2) of postures with a way between them: its middle is on the manifold, inside, and near."""
    pairs = _neighbours(postures)
    ends = postures[pairs]
    middle: Array = ends.mean(axis=1)
    half = 0.5 * np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    on = close(arm, middle, x)
    good = np.linalg.norm(arm.reach(on)[0] - x, axis=1) < CLOSED
    good &= np.all((np.asarray(bounds[0]) <= on) & (on <= np.asarray(bounds[1])), axis=1)
    good &= np.linalg.norm(on - middle, axis=1) <= STRAIGHT * half
    ways: NDArray[np.int64] = pairs[good]
    return ways


def _neighbours(postures: Array) -> NDArray[np.int64]:
    """Every posture (k, n) with those next to it, (pairs, 2)."""
    most, squares = min(NEIGHBOURS + 1, len(postures)), np.sum(postures**2, axis=1)
    found = []
    for first in range(0, len(postures), CHUNK):
        rows = postures[first : first + CHUNK]
        distance = squares - 2.0 * rows @ postures.T  # but for the rows' own squares
        near = np.argpartition(distance, most - 1, axis=1)[:, :most]
        own = np.repeat(np.arange(first, first + len(rows)), most)
        found.append(np.stack([own, near.ravel()], axis=1))
    pairs: NDArray[np.int64] = np.concatenate(found)
    return pairs


def _connected(count: int, ways: NDArray[np.int64]) -> NDArray[np.int64]:
    """A number for each of count postures, the same where ways lead from one to the other."""
    label: NDArray[np.int64] = np.arange(count)
    a, b = ways.T
    while True:
        least = np.minimum(label[a], label[b])
        before = label.copy()
        np.minimum.at(label, a, least)
        np.minimum.at(label, b, least)
        label = label[label]  # a label is the number of a posture: follow it
        if np.array_equal(label, before):
            return np.unique(label, return_inverse=True)[1]
