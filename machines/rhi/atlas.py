"""Where a posture can follow the hand best, all over the hand's reach.

Far from the places that have targets of their own what counts is that the hand can go on, whatever its way,
and does not meet the end of a motor where another posture could have followed it. A part of the self-motion
may end 10 cm further: so parts are told by those that they lead to.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...models import Array, ModelError
from .guard import Span
from .once import Once, tried
from .reachable import SPARE, Parts, Way
from .redundant import PLACE, RedundantArm
from .self_motion import close

GRID = 0.1
"""Distance of the places that are looked at [m]."""
MOST = 250
"""Of them; where the hand reaches more there is no atlas."""
SCANNED = 300
"""Configurations scanned at each place."""
CLOSING = 4
"""Steps with which a posture follows the hand to the next place."""
NEAR = 0.5
"""Distance from which on a posture there says nothing of its part [rad]."""
LED = 0.6
"""What a direction to go on in counts a place further."""
SWEEPS = 8
"""Places further that are looked at."""
ROOM = 0.5
"""What counts room to follow as far as the next place; a direction to go on in counts 1 and more."""
MOST_ROOM = 1.0
"""More room counts as this [m]."""
STILL = 1e-9
"""A motor that turns less than this as the hand goes 1 m does not follow it [rad/m]."""


class Atlas:
    """The self-motion at places on a grid, and to which posture to turn at each."""

    def __init__(self, arm: RedundantArm, span: Span) -> None:
        """Look at all that the hand reaches.

        At nothing where that is more than MOST, or a posture has no direction to spare, or more than SPARE.
        """
        self._pages: dict[tuple[int, ...], _Page] = {}
        if arm.m > PLACE or not 0 < arm.n - arm.m <= SPARE:
            return
        cells = {_cell(hand) for hand in tried(arm, span)}
        for cell in sorted(cells) if len(cells) <= MOST else ():
            try:
                self._pages[cell] = _Page(arm, GRID * np.array(cell), span)
            except ModelError:
                continue  # out of reach
        for cell, page in self._pages.items():
            around = [np.add(cell, way) for way in product((-1, 0, 1), repeat=arm.m) if any(way)]
            pages = [self._pages.get(tuple(each.tolist())) for each in around]
            page.look(arm, span, [each for each in pages if each])
        for _ in range(SWEEPS):
            found = [page.best_of_parts() for page in self._pages.values()]
            for page, value in zip(self._pages.values(), found, strict=True):
                page.value = value / (3**arm.m - 1)
        for page in self._pages.values():
            page.settle()

    def ahead(self, x: Array, q: Array) -> Array | None:
        """The next posture (n,) on the way from q (n,) with the hand at x (m,); None outside of the atlas."""
        page = self._pages.get(_cell(x))
        return page.ahead(q) if page else None


_ATLASES = Once[Atlas](8)


def atlas_of(arm: RedundantArm, span: Span) -> Atlas:
    """The atlas of an arm: the one drawn before where there is one."""
    return _ATLASES.get(arm, span, (), lambda: Atlas(arm, span))


def _cell(x: Array) -> tuple[int, ...]:
    return tuple(np.round(x / GRID).astype(int).tolist())


class _Page:
    """One place of the hand.

    Attributes:
        x: (m,) [m]; parts: of the self-motion there.
        value: of each part, in which directions the hand can go on from it, and from where that leads.
    """

    def __init__(self, arm: RedundantArm, x: Array, span: Span) -> None:
        """Scan. Raises ModelError where no posture holds the hand at x (m,)."""
        self.x, self.parts = x, Parts(arm, x, span.inside(span.margin), SCANNED, 1)
        self.value = np.zeros(1 + int(self.parts.part.max()))
        self._room = ROOM / GRID * _room_to_follow(arm, self.parts.postures, span)
        self._on: list[tuple[_Page, NDArray[np.bool_], NDArray[np.int64]]] = []
        self._ways: list[Way] = []

    def look(self, arm: RedundantArm, span: Span, around: Sequence[_Page]) -> None:
        """Whether each posture can follow to the places around, and to which part."""
        lower, upper = span.inside(0.5 * span.margin)
        for page in around:
            led = close(arm, self.parts.postures, page.x, CLOSING)
            there = page.parts.postures
            squares = np.sum(led**2, axis=1)[:, None] + np.sum(there**2, axis=1) - 2.0 * led @ there.T
            nearest = squares.argmin(axis=1)
            can = np.all((lower <= led) & (led <= upper), axis=1) & (squares.min(axis=1) < NEAR**2)
            self._on.append((page, can, page.parts.part[nearest]))

    def _scores(self) -> Array:
        """Of each posture, (k,)."""
        scores = self._room.copy()
        for page, can, part in self._on:
            scores += can * (1.0 + LED * page.value[part])
        return scores

    def best_of_parts(self) -> Array:
        """Score of the best posture of each part."""
        scores, best = self._scores(), np.zeros(len(self.value))
        np.maximum.at(best, self.parts.part, scores)
        return best

    def settle(self) -> None:
        """Find the ways to the best posture of each part."""
        scores = self._scores()
        for part in range(len(self.value)):
            own = np.flatnonzero(self.parts.part == part)
            self._ways.append(Way(self.parts, self.parts.postures[own[np.argmax(scores[own])]]))

    def ahead(self, q: Array) -> Array:
        """The next posture (n,) on the way from q (n,) to the best of its part."""
        return self._ways[self.parts.of(q)].go_on(q)[1]


def _room_to_follow(arm: RedundantArm, q: Array, span: Span) -> Array:
    """How far the hand can go from postures (k, n) before a motor that only follows is at a limit, (k,) [m].

    Whatever its way, to first order; at most MOST_ROOM.
    """
    lower, upper = span.inside(0.0)
    followed = np.maximum(np.linalg.norm(np.linalg.pinv(arm.reach(q)[1]), axis=2), STILL)
    room: Array = np.min(np.minimum(q - lower, upper - q) / followed, axis=1)
    return np.minimum(room, MOST_ROOM)
