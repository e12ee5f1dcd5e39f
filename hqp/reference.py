"""A slow cascade of quadratic programs on quadprog, to compare with. For tests and benchmarks only.

quadprog is GPL: nothing but this module imports it, and the daemon never imports this module.
"""

from collections.abc import Callable, Sequence

import numpy as np

from .certificate import slack_norms, slacks
from .problem import Array, Level

PROXIMITY = (
    1e-6  # weight of |step|^2 beside a level's least squares, lifted by repeating the solve from its result
)
REPEATS = 5
MET = 1e-9  # times (1 + |bound|): slack that counts as none
RANK = 1e-11  # of the size of the rows
ROUNDING = (
    1e-12  # times (1 + |bound|): by which bounds give way where a QP solver takes them for inconsistent
)

Qp = Callable[[Array, Array, Array, Array], tuple[Array, int]]


class QpError(ValueError):
    """The QP solver gave up."""


def quadprog_qp(H: Array, linear: Array, rows: Array, least: Array) -> tuple[Array, int]:
    """Minimise z'Hz / 2 - linear'z over rows z >= least, with H positive definite, on quadprog.

    Returns:
        z, and the number of iterations.

    Raises:
        QpError: quadprog finds the constraints inconsistent, which it also does where they are not.
    """
    import quadprog

    try:
        z, _, _, iterations, *_ = quadprog.solve_qp(H, linear, rows.T, least)
    except ValueError as error:
        raise QpError(f"quadprog: {error}") from error
    return z, int(iterations[0])


def first_mismatch(norms: Array, expected: Array, tolerance: float) -> int | None:
    """The first level (from 0) whose slack norm is off by more than tolerance (1 + expected), or None."""
    differs = np.abs(norms - expected) > tolerance * (1.0 + expected)
    return int(np.argmax(differs)) if differs.any() else None


def reference(levels: Sequence[Level], qp: Qp = quadprog_qp, repeats: int = REPEATS) -> Array:
    """Solve level by level: each minimises its slack on the minimisers of the levels before.

    The rows that a level leaves violated, and its equalities, fix their value for all later levels; the other
    rows become hard constraints of them.

    Args:
        levels: the problem; finite data with lb <= ub.
        qp: solves one QP, like quadprog_qp.
        repeats: QPs for each level at most, each starting where the last one ended.

    Returns:
        x, (n,).

    Raises:
        QpError: the QP solver gave up.
    """
    n = levels[0].n
    x, free, hard = np.zeros(n), np.eye(n), Level(C=np.zeros((0, n)), lb=np.zeros(0), ub=np.zeros(0))
    for level in map(_without_points, levels):
        for _ in range(repeats):
            step = _solve_level(level, hard, x, free, qp)
            x = x + step
            if np.linalg.norm(step) <= 1e-12 * (1.0 + np.linalg.norm(x)):
                break
        x = _polish(level, hard, x, free)
        _, v = slacks(level, x)
        violated = np.abs(v) > MET * (1.0 + np.abs(level.C @ x))
        free = _null_space(np.vstack([level.A, level.C[violated]]), free)
        hard = Level(
            C=np.vstack([hard.C, level.C[~violated]]),
            lb=np.concatenate([hard.lb, level.lb[~violated]]),
            ub=np.concatenate([hard.ub, level.ub[~violated]]),
        )
    return x


def _without_points(level: Level) -> Level:
    """The level with ranges that are points moved to the equalities."""
    point = level.ub - level.lb <= MET * (1.0 + np.abs(np.nan_to_num(level.lb)))
    return Level(
        A=np.vstack([level.A, level.C[point]]),
        b=np.concatenate([level.b, 0.5 * (level.lb[point] + level.ub[point])]),
        C=level.C[~point],
        lb=level.lb[~point],
        ub=level.ub[~point],
    )


def _solve_level(level: Level, hard: Level, x: Array, free: Array, qp: Qp) -> Array:
    """The step free y, (n,): |A step - r|^2 + |v|^2 + PROXIMITY |y|^2 least, with hard rows kept."""
    m, soft = free.shape[1], len(level.C)
    if m == 0:
        return np.zeros(len(x))
    A, C = level.A @ free, level.C @ free
    H = np.zeros((m + soft, m + soft))
    H[:m, :m] = A.T @ A + PROXIMITY * np.eye(m)
    H[m:, m:] = np.eye(soft)
    linear = np.concatenate([A.T @ (level.b - level.A @ x), np.zeros(soft)])
    kept = np.hstack([hard.C @ free, np.zeros((len(hard.C), soft))])
    own = np.hstack([C, np.eye(soft)])
    value, own_value = hard.C @ x, level.C @ x
    rows = np.vstack([kept, -kept, own, -own])
    least = np.concatenate(
        [
            np.minimum(hard.lb - value, 0.0),
            np.minimum(value - hard.ub, 0.0),
            level.lb - own_value,
            own_value - level.ub,
        ]
    )
    acts = np.isfinite(least) & (np.linalg.norm(rows, axis=1) > 1e-9)
    if not acts.any():
        return np.asarray(free @ np.linalg.solve(H, linear)[:m])
    rows, least = rows[acts], least[acts]
    try:
        solution, _ = qp(H, linear, rows, least)
    except QpError:  # no step meets the constraints: what closed them is rounding
        solution, _ = qp(H, linear, rows, least - ROUNDING * (1.0 + np.abs(least)))
    return np.asarray(free @ solution[:m])


def _polish(level: Level, hard: Level, x: Array, free: Array) -> Array:
    """The same minimum without the proximity term, given the rows that are active or violated at x."""
    _, v = slacks(level, x)
    value = hard.C @ x
    violated = np.abs(v) > MET * (1.0 + np.abs(level.C @ x))
    with np.errstate(invalid="ignore"):
        active = np.minimum(value - hard.lb, hard.ub - value) <= MET * (1.0 + np.abs(value))
    inside = _null_space(hard.C[active], free)
    J = np.vstack([level.A, level.C[violated]])
    left, sizes, right = np.linalg.svd(J @ inside, full_matrices=False)
    rank = int(np.sum(sizes > RANK * np.linalg.norm(J)))
    residual = np.concatenate([level.b - level.A @ x, v[violated]])
    better = x + inside @ right[:rank].T @ (left[:, :rank].T @ residual / sizes[:rank])
    kept = np.abs(slacks(hard, better)[1]) <= MET * (1.0 + np.abs(hard.C @ better))
    return better if kept.all() and slack_norms([level], better) <= slack_norms([level], x) else x


def _null_space(rows: Array, free: Array) -> Array:
    """What the rows leave of the span of free, orthonormal columns."""
    if not len(rows) or not free.shape[1]:
        return free
    _, sizes, right = np.linalg.svd(rows @ free)
    rank = int(np.sum(sizes > RANK * np.linalg.norm(rows)))
    return np.asarray(free @ right[rank:].T)
