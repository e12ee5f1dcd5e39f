"""The self-motion manifold: all configurations that hold the hand in one place, scanned and searched."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ...models import Array, ModelError
from .manipulability import stein, stein_gradient, velocity_ellipsoid
from .redundant import RedundantArm

CLOSED = 1e-9
"""Distance to the wanted position at which a configuration counts as on the manifold [m]."""
ARRIVED = 1e-5
"""Distance from which one more step is exact [m]: Gauss-Newton squares it."""
CLOSING_STEPS = 12
LARGEST_STEP = 0.5
"""Largest step of one iteration, per joint [rad]."""

Bounds = tuple[Sequence[float], Sequence[float]] | tuple[Array, Array]
"""Lower and upper limits of the motors, (n,) each [rad]."""


class Objective(Protocol):
    """A cost of postures by their Jacobians; takes stacks."""

    def cost(self, J: Array) -> Array:
        """Cost (...,) of J (..., m, n)."""

    def gradient(self, J: Array, dJ: Array) -> Array:
        """Its derivative by q, (..., n), for dJ (..., n, m, n)."""


class Ellipsoid:
    """Stein divergence from a desired force ellipsoid, ContactAware, (10)."""

    def __init__(self, desired: Array, limit: Array) -> None:
        """Desired force ellipsoid (m, m) and torque limits (n,)."""
        self._B: Array = np.asarray(np.linalg.inv(desired), float)
        self._limit = limit

    def cost(self, J: Array) -> Array:
        """Divergence v, (...,)."""
        return stein(velocity_ellipsoid(J, self._limit), self._B)

    def gradient(self, J: Array, dJ: Array) -> Array:
        """dv/dq, (..., n)."""
        return stein_gradient(J, dJ, self._limit, self._B)


def close(arm: RedundantArm, q: Array, x: Array, steps: int = CLOSING_STEPS) -> Array:
    """Move configurations (k, n) by Gauss-Newton steps onto the manifold of x, (m,) or (k, m)."""
    found: Array = np.array(q, float, order="C")
    targets = np.ascontiguousarray(np.broadcast_to(x, (len(found), arm.m)), float)
    arm.approach(found, targets, steps, LARGEST_STEP, ARRIVED)
    return found


def scan(arm: RedundantArm, x: Array, bounds: Bounds, count: int, seed: int = 0) -> Array:
    """Configurations (k, n), k <= count, that hold the hand at x (m,) within joint bounds.

    Random configurations are moved onto the manifold; those that do not get there, or leave the bounds on
    the way, are dropped.
    """
    lower, upper = np.array(bounds[0], float), np.array(bounds[1], float)
    start = np.random.default_rng(seed).uniform(lower, upper, (count, arm.n))
    q = close(arm, start, x)
    position, _ = arm.reach(q)
    good = np.linalg.norm(position - x, axis=1) < CLOSED
    good &= np.all((lower <= q) & (q <= upper), axis=1)
    found: Array = q[good]
    return found


def descend(
    arm: RedundantArm,
    q: Array,
    x: Array,
    objective: Objective,
    iterations: int = 200,
    bounds: Bounds | None = None,
) -> tuple[Array, Array]:
    """Local optima along the manifold from many starts at once: configurations (k, n) and costs (k,).

    Projected gradient steps whose length each start adapts on its own; every accepted step lowers the cost.

    Args:
        arm: the interface.
        q: starts on the manifold, (k, n).
        x: where the hand stays, (m,) or (k, m).
        objective: what shall be least.
        iterations: of every start.
        bounds: of the motors, (n,) each [rad], that no step leaves; starts are inside.
    """
    q = np.array(q, float)
    lower, upper = bounds if bounds is not None else (-np.inf, np.inf)
    _, J, dJ = arm.sweep(q)
    cost = objective.cost(J)
    length = np.full(len(q), 0.1)
    for _ in range(iterations):
        slope = objective.gradient(J, dJ)
        slope -= _pseudo_solve(J, np.einsum("kai,ki->ka", J, slope))
        wanted = np.clip(q - _limited(length[:, None] * slope), lower, upper)
        trial = close(arm, wanted, x, 3)
        position, J_trial, dJ_trial = arm.sweep(trial)
        cost_trial = objective.cost(J_trial)
        better = (cost_trial < cost) & (np.linalg.norm(position - x, axis=1) < CLOSED)
        better &= np.all((lower <= trial) & (trial <= upper), axis=1)
        q[better], cost[better] = trial[better], cost_trial[better]
        J[better], dJ[better] = J_trial[better], dJ_trial[better]
        length *= np.where(better, 1.5, 0.3)
    return q, cost


def best_posture(
    arm: RedundantArm,
    x: Array,
    bounds: Bounds,
    objective: Objective,
    count: int,
    polished: int = 8,
) -> Array:
    """The posture (n,) with the least cost that holds the hand at x (m,), by scan and descent.

    Args:
        arm: the interface.
        x: where the hand is, (m,) [m].
        bounds: of the joints, (n,) each [rad].
        objective: what shall be least.
        count: configurations of the scan.
        polished: how many of the best are improved further.

    Raises:
        ModelError: no configuration within the bounds reaches x.
    """
    postures = scan(arm, x, bounds, count)
    if not len(postures):
        raise ModelError(
            "the interface", 0, f"cannot reach {x.tolist()} m", "move the point, widen the limits"
        )
    costs = objective.cost(arm.reach(postures)[1])
    start = postures[np.argsort(costs)[:polished]]
    found, cost = descend(arm, start, x, objective, bounds=bounds)
    best: Array = found[np.argmin(cost)]
    return best


def _pseudo_solve(J: Array, e: Array) -> Array:
    """Least-norm dq with J dq = e, slightly damped, (k, n)."""
    A = J @ np.swapaxes(J, 1, 2) + 1e-12 * np.eye(J.shape[1])
    dq: Array = np.einsum("kai,ka->ki", J, np.linalg.solve(A, e[..., None])[..., 0])
    return dq


def _limited(dq: Array) -> Array:
    """Steps (k, n) shortened where one joint would go further than LARGEST_STEP."""
    size = np.max(np.abs(dq), axis=1, keepdims=True)
    limited: Array = dq * np.minimum(1.0, LARGEST_STEP / np.maximum(size, 1e-300))
    return limited
