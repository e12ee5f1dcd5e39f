"""Postures that the interface can turn to with the hand in one place and every motor inside its limits.

Limits divide the self-motion into parts: from one to another there is no way but across a limit, or by
another place of the hand. A target is of use only in the part where the interface is.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ...models import Array, ModelError
from .guard import Span
from .redundant import PLACE, RedundantArm
from .self_motion import ARRIVED, CLOSED, Bounds, Objective, close, descend, scan

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
FOLLOWED = (0.12, 0.08, 0.05, 0.03)
"""How far the hand leaves the place of a target [m]: the first for which a part has postures that need do no
more than follow it to stay inside the limits."""
ENOUGH = 0.08
"""What lets the hand go so far is no dead end [m]."""
STRIDE = 0.02
"""Of the steps in which they do [m]."""
SPARE = 2
"""Directions that a posture may have besides the hand's for that to count: with more of them it makes room on
the way, and to only follow asks for too much."""
TRACED = 600
"""Postures of a part that are tried for that."""
AHEAD = 0.6
"""How far the next posture is on a way [rad]."""


class Parts:
    """The self-motion at x, scanned, in parts that are connected inside the limits.

    Attributes:
        postures: (k, n) [rad]; part: of each, (k,), from 0.
        ways: pairs of them with a way between them, (w, 2).
    """

    def __init__(self, arm: RedundantArm, x: Array, bounds: Bounds, count: int, least: int = LEAST) -> None:
        """Scan with so many configurations; parts of fewer than ``least`` postures are left out.

        Raises:
            ModelError: no configuration within the bounds (n,) each [rad] reaches x (m,) [m].
        """
        postures = scan(arm, x, bounds, count)
        if not len(postures):
            raise ModelError(
                "the interface", 0, f"cannot reach {x.tolist()} m", "move the point, widen the limits"
            )
        ways = _ways(arm, x, bounds, postures)
        part = _connected(len(postures), ways)
        sizes = np.bincount(part)
        keep = sizes[part] >= min(least, int(sizes.max()))
        self.postures: Array = postures[keep]
        self.part: NDArray[np.int64] = np.unique(part[keep], return_inverse=True)[1]
        number = np.cumsum(keep) - 1
        self.ways: NDArray[np.int64] = number[ways[keep[ways].all(axis=1)]]

    def of(self, q: Array, near: float = np.inf) -> int:
        """The part of the posture next to q (n,); -1 where that is no nearer than so [rad]."""
        distance = np.linalg.norm(self.postures - q, axis=1)
        k = int(np.argmin(distance))
        return int(self.part[k]) if distance[k] < near else -1

    def distances(self, q: Array) -> Array:
        """How long the ways inside the limits are from each posture to the one next to q (n,), (k,) [rad]."""
        (a, b), far = self.ways.T, np.full(len(self.postures), np.inf)
        far[np.argmin(np.linalg.norm(self.postures - q, axis=1))] = 0.0
        length = np.linalg.norm(self.postures[a] - self.postures[b], axis=1)
        while True:
            before = far.copy()
            np.minimum.at(far, a, far[b] + length)
            np.minimum.at(far, b, far[a] + length)
            if np.array_equal(far, before):
                return far


class Way:
    """Ways inside the limits to a posture, from all others of a place that are connected with it.

    A straight pull ends in a corner of the limits where they lie between a posture and its target.
    """

    def __init__(self, parts: Parts, end: Array) -> None:
        """Of these parts, to the posture next to ``end`` (n,) [rad]."""
        self._postures, self._left = parts.postures, parts.distances(end)

    def go_on(self, q: Array) -> tuple[float, Array]:
        """How much of a shortest way is left from the posture next to q (n,) [rad], and the next on it, (n,).

        Infinite, and any posture, where none leads there.
        """
        away = np.linalg.norm(self._postures - q, axis=1)
        nearest = np.argmin(away)
        on = np.flatnonzero(away <= max(AHEAD, away[nearest]))
        ahead: Array = self._postures[on[np.argmin(self._left[on])]]
        return float(self._left[nearest]), ahead


class Targets:
    """The best posture of each part, for each of several objectives.

    Attributes:
        parts: of the self-motion.
        best: (parts, objectives, n) [rad].
        cost: of them, (parts, objectives).
        ways: of each part, on which the hand can leave x while any of its targets only follows, (w, m) [m];
            none with more than SPARE directions to spare.
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
        self.ways: list[Array] = []
        for part in range(number):
            own = np.flatnonzero(self.parts.part == part)
            ways: Array = np.empty((0, arm.m))
            if arm.n - arm.m <= SPARE:
                own, ways = _leading_on(arm, self.parts.postures, own[:TRACED], x, bounds)
            self.ways.append(ways)
            own, limits = _roomy(self.parts.postures, own, span, bounds)
            for k, objective in enumerate(objectives):
                costs = objective.cost(J[own])
                first = own[np.argsort(costs)[:POLISHED]]
                start = self.parts.postures[first]
                found, cost = descend(arm, start, x, objective, bounds=limits)
                for way in ways:
                    astray = ~lead(arm, found, x, bounds, way)[0]
                    found[astray], cost[astray] = start[astray], objective.cost(J[first[astray]])
                self.best[part, k], self.cost[part, k] = found[np.argmin(cost)], np.min(cost)

    @property
    def reach(self) -> Array:
        """Length of all ways of each part, of each no more than ENOUGH, (parts,) [m]."""
        return np.array([np.minimum(np.linalg.norm(ways, axis=1), ENOUGH).sum() for ways in self.ways])

    def reachable(self, q: Array) -> Array:
        """Targets in the part of a posture (n,), (objectives, n)."""
        targets: Array = self.best[self.parts.of(q)]
        return targets


def _leading_on(
    arm: RedundantArm, postures: Array, own: NDArray[np.int64], x: Array, bounds: Bounds
) -> tuple[NDArray[np.int64], Array]:
    """Those of a part's postures that can follow the hand farthest from x, and the ways (w, m) that they can.

    A way on which none of them gets that far leads out of the interface's reach, and counts for nothing.
    """
    for far in FOLLOWED:
        ways = far * directions(arm.m)
        able = np.stack([lead(arm, postures[own], x, bounds, way)[0] for way in ways], axis=1)
        within_reach = able.any(axis=0)
        good = able[:, within_reach].all(axis=1)
        if within_reach.any() and np.count_nonzero(good) >= LEAST:
            return own[good], ways[within_reach]
    return own, np.empty((0, arm.m))


def directions(m: int) -> Array:
    """Unit vectors (w, m) along the axes of the hand's place and between two of them, to both sides."""
    signs = np.array(list(product((-1.0, 0.0, 1.0), repeat=min(m, PLACE))))
    count = np.count_nonzero(signs, axis=1)
    signs = signs[(count > 0) & (count < 3)]
    found = np.zeros((len(signs), m))
    found[:, : signs.shape[1]] = signs / np.linalg.norm(signs, axis=1, keepdims=True)
    return found


def lead(
    arm: RedundantArm, q: Array, x: Array, bounds: Bounds, way: Array
) -> tuple[NDArray[np.bool_], Array]:
    """Postures (k, n) that only follow the hand from x (m,) along a way (m,) [m].

    Returns:
        which of them stay inside the bounds (n,) each, (k,), and what becomes of those, (k, n) [rad].
    """
    good, at = np.ones(len(q), bool), np.array(q)
    steps = ceil(float(np.linalg.norm(way)) / STRIDE)
    for step in range(1, steps + 1):
        goal = x + step / steps * way
        at[good] = close(arm, at[good], goal, 4)
        good &= np.linalg.norm(arm.reach(at)[0] - goal, axis=1) < ARRIVED
        good &= np.all((np.asarray(bounds[0]) <= at) & (at <= np.asarray(bounds[1])), axis=1)
    return good, at


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
    """Every posture (k, n) with those next to it, each pair once, (pairs, 2)."""
    count, squares = len(postures), np.sum(postures**2, axis=1)
    most, found = min(NEIGHBOURS + 1, count), []
    for first in range(0, count, CHUNK):
        rows = postures[first : first + CHUNK]
        distance = squares - 2.0 * rows @ postures.T  # but for the rows' own squares
        near = np.argpartition(distance, most - 1, axis=1)[:, :most].ravel()
        own = np.repeat(np.arange(first, first + len(rows)), most)
        found.append(np.minimum(own, near) * count + np.maximum(own, near))
    pairs: NDArray[np.int64] = np.stack(np.divmod(np.unique(np.concatenate(found)), count), axis=1)
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
