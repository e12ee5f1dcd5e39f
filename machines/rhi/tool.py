"""A tool in the hand, whose points meet the bodies: force and torque, where the hand turns, too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...models import Array
from .environment import Environment
from .redundant import PLACE, RedundantArm

Point = tuple[float, float, float]


class Tool:
    """What an environment does to the hand through some points of what it holds; see ``Environment``.

    Attributes:
        depth: of the deepest point in the body in which it is deepest [m].
        energy: what the environment stores [J]; granted: what of that nobody has put in.
    """

    def __init__(
        self, environment: Environment, points: Sequence[Sequence[float]], arm: RedundantArm
    ) -> None:
        """Points of the tool in the hand's axes, (3,) each [m]; the arm that carries it."""
        self._environment, self._points, self._arm = environment, np.array(points, float), arm
        self.depth = self.energy = self.granted = 0.0

    def force(self, position: Sequence[float], velocity: Sequence[float] = ()) -> list[float]:
        """Force (3,) [N] and torque over the lever (3,) [N] on a hand at a position, as the arm turned it.

        Args:
            position: along the arm's directions (6,) [m].
            velocity: the same (6,) [m/s]; none: at rest.
        """
        lever, rendered = self._arm.lever, self._environment
        vx, vy, vz, *turning = velocity or [0.0] * len(position)
        wx, wy, wz = (rate / lever for rate in turning)
        total = [0.0] * 6
        self.depth = self.energy = self.granted = 0.0
        for x, y, z in (self._points @ self._arm.rotation.T).tolist():
            where = [p + r for p, r in zip(position[:PLACE], (x, y, z), strict=True)]
            fast = [vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x]
            fx, fy, fz = rendered.force(where, fast)
            torque = (y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
            pushed = (fx, fy, fz, *(t / lever for t in torque))
            total = [a + b for a, b in zip(total, pushed, strict=True)]
            self.depth = max(self.depth, rendered.depth)
            self.energy += rendered.energy
            self.granted += rendered.granted
        return total

    def surface(self, x: Sequence[float]) -> tuple[list[float], list[float]] | None:
        """See ``Environment``; for the tool's first point, and a hand that is not turned."""
        tip = self._tip()
        found = self._environment.surface((np.array(x[:PLACE]) + tip).tolist())
        if found is None:
            return None
        place, into = self.held(*map(np.array, found))
        return place.tolist(), into.tolist()

    def held(self, point: Array, into: Array) -> tuple[Array, Array]:
        """Where the hand is (6,) if the tool's first point is at a point (3,), and what pushes it there (6,).

        ``into`` is the unit vector into the body, (3,); that of the hand has the torque beside it.
        """
        tip = self._tip()
        push = np.concatenate([into, np.cross(tip, into) / self._arm.lever])
        return np.concatenate([point - tip, np.zeros(PLACE)]), push / np.linalg.norm(push)

    def _tip(self) -> Array:
        tip: Array = self._arm.reference @ self._points[0]
        return tip
