"""What is drawn once for all arms of a process that reach the same within the same limits.

It takes a second or two, a study or an experiment has many sessions of one interface, and a session that
runs live has a rehearsal before it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

from ...models import Array
from .guard import Span
from .redundant import RedundantArm

TRIED = 4000
"""Random postures that say what the hand reaches."""

T = TypeVar("T")


class Once(Generic[T]):
    """Keeps what was asked for last."""

    def __init__(self, most: int) -> None:
        """``most``: so many of them."""
        self._most, self._kept = most, dict[tuple[object, ...], T]()

    def get(self, arm: RedundantArm, span: Span, what: tuple[object, ...], draw: Callable[[], T]) -> T:
        """Of an arm within limits; ``what`` else it depends on; ``draw``: makes it."""
        reached = tried(arm, span).tobytes()
        same = (arm.n, tuple(span.lower), tuple(span.upper), span.margin, reached, *what)
        self._kept[same] = found = self._kept.pop(same, None) or draw()
        if len(self._kept) > self._most:
            del self._kept[next(iter(self._kept))]
        return found


def tried(arm: RedundantArm, span: Span) -> Array:
    """Where random postures within the limits hold the hand, (TRIED, m) [m]."""
    low, high = (np.clip(end, -np.pi, np.pi) for end in span.inside(span.margin))
    hands, _ = arm.reach(np.random.default_rng(0).uniform(low, high, (TRIED, arm.n)))
    return hands
