"""Multipliers of one level: which rows of earlier levels keep it from getting smaller, and how hard."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .certificate import Mask, activity, gradient, slacks, weighted_slacks
from .problem import Array, HqpError, Level, check_levels, check_numbers, check_point, check_tolerance
from .solver import Status, solve


class Multipliers(NamedTuple):
    """Multipliers of the rows of one earlier level: A (equalities,) and C (inequalities,)."""

    A: Array
    C: Array


class Conflict(NamedTuple):
    """A row that takes part in a conflict.

    Attributes:
        level: from 0.
        part: "A" or "C".
        row: from 0, in that part.
        multiplier: its share; of a row of the level that gives way, its slack times its weight.
    """

    level: int
    part: str
    row: int
    multiplier: float


def multipliers(levels: Sequence[Level], x: Array, level: int, tolerance: float = 1e-9) -> list[Multipliers]:
    """The multipliers that prove one level minimal at x.

    With g the gradient of half of the level's weighted squared slack, -g = sum over the earlier levels of
    A^T y + C^T z: z >= 0 at an upper bound, <= 0 at a lower one, 0 between, of any sign where the row is left
    violated or has lb = ub. Where the rows are dependent these are one choice of many.

    Args:
        levels: the problem.
        x: its solution, (n,).
        level: from 0; len(levels) - 1 is the last.
        tolerance: as of certificate.

    Returns:
        One Multipliers per level before `level`.

    Raises:
        HqpError: no such level, x of another shape; or at x the level is not minimal, so that there are none.
    """
    _check(levels, x, level, tolerance)
    rows, signs, masks = [], [], []
    for earlier in levels[:level]:
        lower, upper = activity(earlier, x, tolerance)
        _, v = slacks(earlier, x)
        is_free = (lower & upper) | (np.abs(v) > tolerance * (1.0 + np.abs(earlier.C @ x)))
        mask = np.concatenate([np.ones(len(earlier.A), dtype=bool), lower | upper])
        sign = np.concatenate([np.zeros(len(earlier.A)), np.where(is_free, 0.0, upper.astype(float) - lower)])
        rows.append(np.vstack([earlier.A, earlier.C])[mask])
        signs.append(sign[mask])
        masks.append(mask)
    none = np.empty((0, levels[level].n))
    target = -gradient(levels[level], x)
    shares = _combination(np.vstack([none, *rows]), np.concatenate([none[:, 0], *signs]), target)
    taken = np.split(shares, np.cumsum([len(part) for part in rows], dtype=int))[:-1]
    return [
        _spread(earlier, mask, values)
        for earlier, mask, values in zip(levels[:level], masks, taken, strict=True)
    ]


def _check(levels: Sequence[Level], x: Array, level: int, tolerance: float) -> None:
    check_levels(levels)
    check_numbers(levels)
    if not isinstance(level, int | np.integer):
        raise HqpError("level", f"is of type {type(level).__name__}", "give its number, from 0")
    check_tolerance(tolerance)
    if not 0 <= level < len(levels):
        raise HqpError("level", f"is {level}", f"number the levels from 0 to {len(levels) - 1}")
    check_point(x, levels[level].n)


def _spread(level: Level, mask: Mask, values: Array) -> Multipliers:
    """The multipliers of the rows in the mask, and 0 for the others."""
    every = np.zeros(len(mask))
    every[mask] = values
    return Multipliers(*np.split(every, [len(level.A)]))


def conflicts(levels: Sequence[Level], x: Array, level: int, tolerance: float = 1e-9) -> list[Conflict]:
    """The rows that keep a level from being met: its own, and those of earlier levels that hold it.

    Weighted by their multipliers the rows cancel and the bounds do not, which no x can meet.

    Args:
        levels: the problem.
        x: its solution, (n,).
        level: from 0, one that is not met.
        tolerance: times the largest multiplier, what counts as none.

    Returns:
        The largest multipliers first; none where the level is met.

    Raises:
        HqpError: as multipliers.
    """
    _check(levels, x, level, tolerance)
    w, v = weighted_slacks(levels[level], x)
    found = [*multipliers(levels, x, level), Multipliers(-w, -v)]
    size = max(np.abs(part).max(initial=0.0) for shares in found for part in shares)
    met = 1e-8 * (1.0 + np.linalg.norm(x))
    if max(np.abs(w).max(initial=0.0), np.abs(v).max(initial=0.0)) <= met:
        return []
    rows = [
        Conflict(p, part, int(row), float(values[row]))
        for p, shares in enumerate(found)
        for part, values in shares._asdict().items()
        for row in np.flatnonzero(np.abs(values) > tolerance * size)
    ]
    return sorted(rows, key=lambda conflict: -abs(conflict.multiplier))


def _combination(rows: Array, signs: Array, target: Array) -> Array:
    """The shares y of rows, of the signs that are not 0, with rows^T y = target."""
    sizes = np.linalg.norm(rows, axis=1)
    acting = sizes > 0.0
    unit = rows[acting] / sizes[acting, None]
    y = np.linalg.lstsq(unit.T, target, rcond=1e-12)[0]
    if (y * signs[acting] < 0.0).any():
        y = _signed_combination(unit, signs[acting], target)
    left = np.linalg.norm(unit.T @ y - target)
    if left > 1e-6 * (1.0 + np.linalg.norm(target)):
        raise HqpError("x", f"leaves {left:.1e} of the level's gradient", "pass the x of a solution")
    shares = np.zeros(len(rows))
    shares[acting] = y / sizes[acting]
    return shares


def _signed_combination(unit: Array, signs: Array, target: Array) -> Array:
    lb = np.where(signs > 0.0, 0.0, -np.inf)
    ub = np.where(signs < 0.0, 0.0, np.inf)
    size = max(float(np.linalg.norm(target)), 1e-300)
    found = solve([Level(lb=lb, ub=ub), Level(A=np.ascontiguousarray(unit.T), b=target / size)])
    if found.status is not Status.SOLVED:
        raise HqpError(
            "multipliers", f"were not found: {found.status}", "look at the conditioning of the rows"
        )
    return size * found.x
