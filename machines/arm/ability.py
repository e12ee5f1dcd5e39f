"""What an arm can do at a posture, and where it can do most."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import pi

import numpy as np
import pinocchio as pin

from ...models import Array, Robot

REGULAR = 0.3
"""Least singular value of the Jacobian, as part of that at home, that counts as regular."""
TRANSLATIONS_FIRST = 0.2
"""Earlier directions are taken where they are so good, as part of the best."""


class Look:
    """An arm at a posture: inertia (m, m), gravity (m,), and the handle's Jacobian (6, m) and place (3,)."""

    def __init__(self, robot: Robot, q: Array) -> None:
        model, data, configuration = robot.model, robot.data, robot.configuration(q)
        M = pin.crba(model, data, configuration)
        self.M: Array = np.triu(M) + np.triu(M, 1).T
        self.gravity: Array = pin.computeGeneralizedGravity(model, data, configuration).copy()
        frame = robot.frame("handle")
        self.J: Array = pin.computeFrameJacobian(model, data, configuration, frame, pin.LOCAL_WORLD_ALIGNED)
        self.place: Array = robot.placement(q, "handle")[:3, 3].copy()

    def regular(self, chosen: Sequence[int], scale: float) -> float:
        """Least singular value of the Jacobian in some directions, rotations as lengths [m]."""
        rows = self.J[list(chosen)] * np.where(np.array(chosen) < 3, 1.0, scale)[:, None]
        return float(np.linalg.svd(rows, compute_uv=False)[-1])


def best_directions(looked: Sequence[Look], scale: float) -> tuple[int, ...]:
    """As many as the joints can give, translations first where they are nearly as good as any."""
    m = looked[0].J.shape[1]
    weights = np.where(np.arange(6) < 3, 1.0, scale)[:, None]
    ranks = [np.linalg.matrix_rank(weights * look.J, tol=1e-3 * scale) for look in looked]
    count = min(m, 6, max(ranks))
    some = looked[::5]
    subsets = list(combinations(range(6), count))
    good = [float(np.median([look.regular(subset, scale) for look in some])) for subset in subsets]
    return next(s for s, value in zip(subsets, good, strict=True) if value >= TRANSLATIONS_FIRST * max(good))


def best_home(
    looked: Sequence[Look], postures: Array, lower: Array, upper: Array, chosen: Sequence[int], scale: float
) -> Array:
    """The sample that is furthest from singularities and limits."""
    width = np.where(np.isfinite(upper - lower), upper - lower, 4.0 * pi)
    room = np.minimum(np.nan_to_num(postures - lower, posinf=pi), np.nan_to_num(upper - postures, posinf=pi))
    share = np.minimum(1.0, 4.0 * (room / width).min(axis=1))
    regular = np.array([look.regular(chosen, scale) for look in looked])
    best = int(np.argmax(regular * share))
    return np.array([round(x, 3) for x in postures[best].tolist()])


def free_reach(
    robot: Robot, home: Array, lower: Array, upper: Array, chosen: Sequence[int], scale: float
) -> float:
    """Half the edge of the largest cube around home in which the arm is regular and inside its limits [m]."""
    along = [i for i in chosen if i < 3]
    there = Look(robot, home)
    at_home = there.regular(chosen, scale)
    ways = [np.array(way) for way in np.ndindex(*(3,) * len(along)) if any(step != 1 for step in way)]
    for share in (1.2, 0.9, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.06):
        h = share * scale
        if all(
            _stays(robot, home, (h * (way - 1), along), (lower, upper), chosen, scale, at_home)
            for way in ways
        ):
            return float(f"{h:.2g}")
    return float(f"{0.03 * scale:.2g}")


def _stays(
    robot: Robot,
    home: Array,
    way: tuple[Array, Sequence[int]],
    limits: tuple[Array, Array],
    chosen: Sequence[int],
    scale: float,
    at_home: float,
) -> bool:
    """Whether the handle gets along a straight way from home without leaving what is regular."""
    step, along = way
    q, start, steps, rows = home.copy(), robot.placement(home, "handle"), 8, list(chosen)
    for k in range(1, steps + 1):
        target = start.copy()
        target[along, 3] += k / steps * step
        for _ in range(3):
            look = Look(robot, q)
            T = robot.placement(q, "handle")
            turn = pin.log3(target[:3, :3] @ T[:3, :3].T)
            error = np.concatenate([target[:3, 3] - T[:3, 3], turn])[rows]
            q = q + np.linalg.pinv(look.J[rows], rcond=1e-3) @ error
        outside = np.any(q < limits[0] + 0.02) or np.any(q > limits[1] - 0.02)
        if outside or Look(robot, q).regular(chosen, scale) < REGULAR * at_home:
            return False
    return True
