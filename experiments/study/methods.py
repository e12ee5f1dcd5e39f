"""Which level comes next: the method of constant stimuli, weighted up-down staircases, QUEST+."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from typing import Protocol

import numpy as np

from .psychometric import Posterior


class Method(Protocol):
    """Levels that follow from the answers so far.

    Attributes:
        count: how many trials there will be, None where the answers decide.
    """

    count: int | None

    def level(self) -> float | None:
        """The next level; None at the end."""

    def answer(self, yes: bool) -> None:
        """What was answered at that level."""


class Constant:
    """Every level equally often, in blocks that hold each of them once in a random order."""

    def __init__(self, levels: Sequence[float], repeats: int, random: Random) -> None:
        self._levels = [x for _ in range(repeats) for x in random.sample(list(levels), len(levels))]
        self.count: int | None = len(self._levels)
        self._next = 0

    def level(self) -> float | None:
        """See ``Method``."""
        return self._levels[self._next] if self._next < len(self._levels) else None

    def answer(self, yes: bool) -> None:
        """See ``Method``."""
        self._next += 1


class Staircase:
    """Down by a step after "yes", up by step p / (1 - p) after "no": levels gather where "yes" has p.

    Kaernbach, Simple adaptive testing with the weighted up-down method, 1991.

    Attributes:
        turns: levels at which it changed its direction.
    """

    def __init__(
        self,
        start: float,
        step: float,
        target: float,
        bounds: tuple[float, float],
        reversals: int,
        most: int,
    ) -> None:
        """Ends after so many reversals, or so many trials at most."""
        self._level, self._down, self._up = start, step, step * target / (1.0 - target)
        self._bounds, self._reversals, self._left = bounds, reversals, most
        self._last: bool | None = None
        self.turns: list[float] = []
        self.count: int | None = None

    def level(self) -> float | None:
        """See ``Method``."""
        return self._level if len(self.turns) < self._reversals and self._left else None

    def answer(self, yes: bool) -> None:
        """See ``Method``."""
        if self._last is not None and yes is not self._last:
            self.turns.append(self._level)
        self._last = yes
        self._left -= 1
        low, high = self._bounds
        self._level = min(high, max(low, self._level - self._down if yes else self._level + self._up))


class QuestPlus:
    """The level whose answer is expected to leave the least entropy (Watson, QUEST+, 2017)."""

    def __init__(self, levels: Sequence[float], trials: int, posterior: Posterior) -> None:
        """``posterior`` takes every answer; somebody else tells it."""
        self._levels, self._posterior, self._left = list(levels), posterior, trials
        self.count: int | None = trials

    def level(self) -> float | None:
        """See ``Method``."""
        if not self._left:
            return None
        return self._levels[int(np.argmin([self._posterior.expected_entropy(x) for x in self._levels]))]

    def answer(self, yes: bool) -> None:
        """See ``Method``."""
        self._left -= 1
