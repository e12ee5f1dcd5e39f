"""Surfaces of triangles, and whether they enclose something."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Triangles = NDArray[np.int64]


class SolidError(ValueError):
    """No body has this surface.

    Attributes:
        problem, fix: for people.
    """

    def __init__(self, problem: str, fix: str) -> None:
        self.problem, self.fix = problem, fix
        super().__init__(f"{problem}; {fix}")


def numbered(vertex: int) -> str:
    """How a vertex is called that is known by its number."""
    return f"vertex {vertex}"


def require_closed(triangles: Triangles, count: int, called: Callable[[int], str] = numbered) -> None:
    """Each edge is gone along as often one way as the other.

    Args:
        triangles: (t, 3), of vertices from 0.
        count: number of vertices.
        called: tells people which vertex one is.

    Raises:
        SolidError: there are no triangles, a vertex is missing, or which edge is open, or which triangles
            turn differently.
    """
    if not len(triangles) or triangles.min() < 0 or triangles.max() >= count:
        raise SolidError(f"needs triangles of vertices from 0 to {count - 1}", "give them")
    ways = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    low, high = ways.min(axis=1), ways.max(axis=1)
    edges, which, used = np.unique(low * count + high, return_inverse=True, return_counts=True)
    over = np.bincount(which.ravel(), weights=np.sign(ways[:, 1] - ways[:, 0]))

    def told(wrong: NDArray[Any]) -> tuple[int, str, int]:
        first = int(np.flatnonzero(wrong)[0])
        a, b = divmod(int(edges[first]), count)
        return int(wrong.sum()), f"from {called(a)} to {called(b)}", int(used[first])

    if (is_open := over % 2 != 0).any():
        many, where, by = told(is_open)
        ends = "one triangle ends" if by == 1 else f"{by} triangles meet"
        raise SolidError(f"is not closed at {many} edges, the first {where}, where {ends}", "close its holes")
    if (turned := over != 0).any():
        many, where, _ = told(turned)
        problem = f"has triangles that turn differently at {many} edges, the first {where}"
        raise SolidError(problem, "let all of them turn the same way, seen from outside")
