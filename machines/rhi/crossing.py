"""Where around a place the parts of its self-motion are joined, so that the interface can go to a better one.

A part from which the hand can go on in few directions only is a dead end: the farther it goes, the fewer
postures are left, until a motor is dragged over its limit. Next to the place the limits may divide the
self-motion in another way, or not at all: while the hand is there, the posture can leave the dead end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...models import Array, ModelError
from .guard import Span
from .reachable import AHEAD, Parts, Targets, Way, directions, lead
from .redundant import RedundantArm
from .self_motion import Bounds

MISSED = -2
"""Part of a place in which a target does not arrive."""
RINGS = (0.05, 0.1)
"""Distances from the place of those that are looked at [m]."""
SCANNED = 2000
"""Configurations scanned at each."""
NEAR = 0.3
"""Distance from which on a posture says nothing of another's part [rad]."""
PERIOD, SURE, SURER = 32, 3, 16
"""Ticks between two looks, and how many of them in a row must lead to a better part, or to a worse one: a way
that the scan has missed divides a part, too."""
BETTER = 1.2
"""How many times as far the hand must be able to go in a part that is better."""


def dead_ends(targets: Targets) -> bool:
    """Whether the hand can go on from one of the parts far less than from another."""
    return bool(targets.reach.max() > BETTER * targets.reach.min())


class Crossings:
    """Says towards which part of a place the posture should go, by where the hand is.

    Attributes:
        part: whose targets are aimed at.
    """

    def __init__(self, arm: RedundantArm, x: Array, targets: Targets, span: Span) -> None:
        """Look around x (m,) [m], where the targets were found."""
        self._bounds = span.inside(span.margin)
        self._reach, self._best = targets.reach, targets.best
        self._looks: list[_Look] = []
        axes = directions(arm.m)
        if arm.m > 2:
            axes = axes[np.count_nonzero(axes, axis=1) == 1]
        for way in (np.zeros(arm.m), *(ring * axis for ring in RINGS for axis in axes)):
            try:
                self._looks.append(_Look(arm, x, way, self._bounds, self._best[:, 0]))
            except ModelError:
                continue  # out of reach
        self._at: Array = np.array([look.x for look in self._looks])
        self.reset(0)

    def reset(self, part: int) -> None:
        """The interface is in a part of the place."""
        self.part = self._said = part
        self._ticks = self._times = 0
        self._crossing = False

    def follow(self, x: Array, q: Array) -> Array | None:
        """A tick with the hand at x (m,) and the posture q (n,): new targets (objectives, n), or None."""
        self._ticks += 1
        if self._ticks % PERIOD:
            return None
        look = self._looks[np.argmin(np.linalg.norm(self._at - x, axis=1))]
        said = self._better(look, q)
        self._times = self._times + 1 if said == self._said else 1
        self._said = said
        sure = SURE if self._reach[said] > self._reach[self.part] else SURER
        if said != self.part and self._times >= sure:
            self.part, self._crossing = said, True
        return self._towards(look, q) if self._crossing else None

    def _towards(self, look: _Look, q: Array) -> Array | None:
        """The next posture on the way to the part, which may lead round limits; at its end the targets.

        None where there is no way at the place of the hand.
        """
        left, ahead = look.ways[self.part].go_on(q)
        if np.isinf(left):
            return None
        targets: Array = self._best[self.part]
        self._crossing = left > AHEAD
        return np.broadcast_to(ahead, targets.shape) if self._crossing else targets

    def _better(self, look: _Look, q: Array) -> int:
        """The part with the longest reach that has a way from here; without any, the one of before."""
        if np.any(q < self._bounds[0]) or np.any(q > self._bounds[1]):
            return self.part
        here = np.flatnonzero(look.arriving == look.parts.of(q, NEAR))
        if not len(here):
            return self.part
        best = int(here[np.argmax(self._reach[here])])
        if self.part in here and self._reach[best] < BETTER * self._reach[self.part]:
            return self.part
        return best


class _Look:
    """The self-motion at one place of the hand.

    Attributes:
        x: (m,) [m]; parts: there.
        arriving: part of this place to which the target of each part of the first one comes, (targets,).
        ways: to these.
    """

    def __init__(self, arm: RedundantArm, x: Array, way: Array, bounds: Bounds, targets: Array) -> None:
        """Go from x (m,) along a way (m,) [m], within bounds (n,) each, with targets (parts, n) [rad].

        Raises:
            ModelError: no posture gets there.
        """
        self.x: Array = x + way
        self.parts = Parts(arm, self.x, bounds, SCANNED, 1)
        good, at = lead(arm, targets, x, bounds, way)
        found = [self.parts.of(q, NEAR) if ok else MISSED for ok, q in zip(good, at, strict=True)]
        self.arriving: NDArray[np.int64] = np.array(found)
        self.ways = [Way(self.parts, q) for q in at]
