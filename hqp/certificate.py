"""Proof of optimality for a hierarchical problem from its data and a point alone: no solver is involved.

With s the slack at x, level p is minimal over the minimisers of the levels before it exactly where the
gradient of 1/2 |s_p|^2 lies in the cone of the rows that earlier levels hold: equalities and rows left
violated (of either sign), and rows at a bound (pointing inside). How far it is from there is a non-negative
least-squares problem.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .cone import INDEPENDENT, distance
from .problem import Array, HqpError, Level, check_levels, check_numbers, check_point, check_tolerance

Mask = NDArray[np.bool_]

ROUNDED = 1e-8
"""A distance that is looked at more closely."""


def slacks(level: Level, x: Array) -> tuple[Array, Array]:
    """Slacks of one level at x.

    Returns:
        w (equalities,) = b - A x, and v (inequalities,), the smallest correction that brings C x into bounds.
    """
    value = level.C @ x
    return level.b - level.A @ x, np.clip(value, level.lb, level.ub) - value


def weighted_slacks(level: Level, x: Array) -> tuple[Array, Array]:
    """As slacks, each times the weight of its row: minus the derivatives of half of the level's square."""
    w, v = slacks(level, x)
    if not len(level.weights):
        return w, v
    of_w, of_v = np.split(level.weights, [len(level.A)])
    return of_w * w, of_v * v


def gradient(level: Level, x: Array) -> Array:
    """Gradient of half of the level's square, of the weighted |w|^2 + |v|^2, at x, (n,)."""
    w, v = weighted_slacks(level, x)
    return np.asarray(-(level.A.T @ w + level.C.T @ v))


def slack_norms(levels: Sequence[Level], x: Array) -> Array:
    """Square root of what each level minimises, the weighted |w|^2 + |v|^2, at x, (levels,).

    Raises:
        HqpError: there are no levels, or x is no array of n numbers.
    """
    check_levels(levels)
    check_point(x, levels[0].n, finite=False)
    both = ((slacks(level, x), weighted_slacks(level, x)) for level in levels)
    squares = [float(np.concatenate(plain) @ np.concatenate(weighted)) for plain, weighted in both]
    return np.asarray(np.sqrt(squares))


def certificate(levels: Sequence[Level], x: Array, tolerance: float = 1e-9) -> Array:
    """Distance of each level's gradient from the cone of the earlier levels' rows.

    It is divided by the level's largest row norm, so that it has the unit of the slack, and by 1 + |slack|,
    so that it is relative where the slack is large.

    Args:
        levels: the problem.
        x: the point to judge, (n,).
        tolerance: times (1 + |bound| + |row| |x|), how far a row may miss its bound before it counts as
            violated, and how close to it it must be to count as active.

    Returns:
        (levels,), 0 where the level is proven minimal.

    Raises:
        HqpError: there are no levels, a solver would refuse a number in them, one of x is not finite, the
            tolerance is not in [0, 1), or scipy is not installed.
    """
    check_levels(levels)
    check_numbers(levels)
    check_tolerance(tolerance)
    n = levels[0].n
    check_point(x, n)
    free, cone = np.zeros((0, n)), np.zeros((0, n))
    distances = np.zeros(len(levels))
    for p, level in enumerate(levels):
        roots = np.sqrt(level.weights) if len(level.weights) else 1.0
        row_norm = (roots * np.linalg.norm(np.vstack([level.A, level.C]), axis=1)).max(initial=1e-300)
        scale = row_norm * (1.0 + slack_norms([level], x)[0])
        distances[p] = _distance(gradient(level, x) / scale, free, cone)
        held, lower, upper = _held_and_active(level, x, tolerance)
        free = np.vstack([free, _unit(level.A), _unit(level.C[held])])
        cone = np.vstack([cone, _unit(level.C[lower]), -_unit(level.C[upper])])
    return distances


def activity(level: Level, x: Array, tolerance: float = 1e-9) -> tuple[Mask, Mask]:
    """Masks of the rows of C at or below their lower bound, and at or above their upper one.

    Args:
        level: one level.
        x: the point, (n,).
        tolerance: as of certificate.

    Returns:
        Two masks (inequalities,).
    """
    value, (reach_lb, reach_ub) = level.C @ x, _reach(level, x, tolerance)
    return value <= level.lb + reach_lb, value >= level.ub - reach_ub


def _reach(level: Level, x: Array, tolerance: float) -> tuple[Array, Array]:
    """How close a row must come to its lower and to its upper bound to count as active."""
    size = 1.0 + np.linalg.norm(level.C, axis=1) * np.linalg.norm(x)
    lb, ub = (np.abs(np.nan_to_num(bound)) for bound in (level.lb, level.ub))
    return tolerance * (size + lb), tolerance * (size + ub)


def _held_and_active(level: Level, x: Array, tolerance: float) -> tuple[Mask, Mask, Mask]:
    """Masks of the rows of C that are held at a value, that lie at their lower and at their upper bound."""
    value, (reach_lb, reach_ub) = level.C @ x, _reach(level, x, tolerance)
    lower, upper = activity(level, x, tolerance)
    violated = (value < level.lb - reach_lb) | (value > level.ub + reach_ub)
    held = violated | (lower & upper)
    return held, lower & ~held, upper & ~held


def _unit(rows: Array) -> Array:
    norms = np.linalg.norm(rows, axis=1)
    return np.asarray(rows[norms > 0.0] / norms[norms > 0.0, None])


def _distance(gradient: Array, free: Array, cone: Array) -> float:
    """Distance of the gradient from {free^T y + cone^T z: z >= 0}."""
    rest, rows = gradient, cone
    if len(free):
        _, sizes, right = np.linalg.svd(free, full_matrices=False)
        basis = right[: int(np.sum(sizes > INDEPENDENT * sizes[0]))]
        for _ in range(2):  # of a row a billionth may be left, and once leaves the rounding of all of it
            rest, rows = rest - basis.T @ (basis @ rest), rows - (rows @ basis.T) @ basis
    norms = np.linalg.norm(rows, axis=1)
    clear = norms > INDEPENDENT
    rows = rows[clear] / norms[clear, None]
    if len(rows):
        try:
            from scipy.optimize import nnls
        except ImportError as error:
            mend = "install hapticd-hqp[certificate]"
            raise HqpError("certificate", "needs scipy, which is not installed", mend) from error
        z, _ = nnls(rows.T, rest, maxiter=100 * len(rows))
        rest = rest - rows.T @ z
    found = float(np.linalg.norm(rest))
    return found if found <= ROUNDED else min(found, distance(gradient, free, cone))
