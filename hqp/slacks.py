"""How far the levels of a solution are from being met."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .problem import Array
from .solver import Solution


class Slacks:
    """Size of what each level is left with: |(w, v)|, in the units of its rows.

    What the solver minimises level by level, where no row has a weight: a level that has some was outranked
    by those before it, or contradicts itself.
    """

    def __init__(self, solution: Solution, levels: int, places: Sequence[int | None]) -> None:
        """Of a solver's one Solution.

        Args:
            solution: whose slacks they are.
            levels: how many are written.
            places: where among them each level of the solution stands; None for one that is left out.
        """
        # the slacks of all levels lie one after another: two blocks instead of twice as many parts as levels
        w, v = solution.w[0].base, solution.v[0].base
        assert w is not None and v is not None
        self._blocks = w, v
        parts = (*solution.w, *solution.v)
        self._squares = np.zeros(sum(part.size for part in parts))
        self._sums = np.zeros((levels, len(self._squares)))
        at = 0
        for part, place in zip(parts, (*places, *places), strict=True):
            if place is not None:
                self._sums[place, at : at + part.size] = 1.0
            at += part.size

    def write(self, out: Array) -> None:
        """Write them, (levels,); NaN where the data of the last solve were refused."""
        np.concatenate(self._blocks, out=self._squares)
        np.multiply(self._squares, self._squares, out=self._squares)
        np.matmul(self._sums, self._squares, out=out)
        np.sqrt(out, out=out)
