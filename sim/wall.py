"""Flat walls that a palm may touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..models import Array
from .hold import Hold

STRONG = 1e6
"""A wall does not give way [N]."""


@dataclass(frozen=True, slots=True)
class Wall:
    """A half-space that yields like a spring and a damper.

    Attributes:
        point: on its face, (3,) [m].
        normal: out of it, (3,), of any length.
        stiffness, damping: [N/m], [N s/m].
    """

    point: Array
    normal: Array
    stiffness: float
    damping: float

    def depth(self, position: Array) -> float:
        """How deep a point (3,) is in it, negative outside [m]."""
        n = self.normal / np.linalg.norm(self.normal)
        return float((self.point - position) @ n)


class Walls:
    """Presses on what touches one of some walls; of several the deepest counts."""

    def __init__(self, walls: Sequence[Wall]) -> None:
        self._walls = walls
        self._normals = [wall.normal / np.linalg.norm(wall.normal) for wall in walls]

    def press(self, hold: Hold, position: Array, velocity: Array) -> None:
        """Tell the hold of a palm at a position (3,) with a velocity (3,) what the wall does to it.

        A wall pushes and never pulls; along its face the damping alone acts.
        """
        hold.strength[:] = 0.0
        rows = zip(self._walls, self._normals, strict=True)
        depths = [float((wall.point - position).dot(normal)) for wall, normal in rows]
        depth = max(depths, default=0.0)
        if depth <= 0.0:
            return
        deepest = depths.index(depth)
        wall, normal = self._walls[deepest], self._normals[deepest]
        if wall.stiffness * depth <= wall.damping * float(normal @ velocity):
            return
        hold.stiffness[0], hold.damping[0], hold.strength[0] = wall.stiffness, wall.damping, STRONG
        hold.error[:3], hold.rate[:3] = depth * normal, 0.0
