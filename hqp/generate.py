"""Random hierarchies of every kind that breaks solvers, for tests and benchmarks."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .problem import Level

Array = NDArray[np.float64]
Draw = np.random.Generator


def _level(rng: Draw, n: int, equalities: int, inequalities: int) -> Level:
    """A dense level whose bounds are of the size of its values; about one bound in four is infinite."""
    lb = rng.normal(size=inequalities) - rng.exponential(size=inequalities)
    ub = lb + rng.exponential(2.0, size=inequalities)
    lb[rng.random(inequalities) < 0.25] = -np.inf
    ub[rng.random(inequalities) < 0.25] = np.inf
    return Level(
        A=rng.normal(size=(equalities, n)),
        b=rng.normal(size=equalities),
        C=rng.normal(size=(inequalities, n)),
        lb=lb,
        ub=ub,
    )


def _hierarchy(rng: Draw, n: int, levels: int) -> list[Level]:
    """Dense levels with about n rows altogether, so that the last ones conflict with the first."""
    rows = rng.integers(0, max(2, n // levels), size=(levels, 2))
    return [_level(rng, n, int(equalities), 1 + int(inequalities)) for equalities, inequalities in rows]


def _matrices(level: Level) -> list[Array]:
    return [matrix for matrix in (level.A, level.C) if len(matrix)]


def dense(rng: Draw, n: int, levels: int) -> list[Level]:
    """Nothing special."""
    return _hierarchy(rng, n, levels)


def rank_deficient(rng: Draw, n: int, levels: int) -> list[Level]:
    """The rows of a level span half of its number of dimensions."""
    problem = _hierarchy(rng, n, levels)
    for level in problem:
        for matrix in _matrices(level):
            rank = max(1, len(matrix) // 2)
            matrix[:] = rng.normal(size=(len(matrix), rank)) @ rng.normal(size=(rank, n))
    return problem


def conflicting(rng: Draw, n: int, levels: int) -> list[Level]:
    """Lower levels repeat rows of upper ones and ask for something else."""
    problem = _hierarchy(rng, n, levels)
    for upper, lower in pairwise(problem):
        for matrix in _matrices(lower):
            source = _matrices(upper)[0]
            for i in range(0, len(matrix), 2):
                matrix[i] = source[rng.integers(len(source))] * rng.choice([-1.0, 1.0, 2.0])
    return problem


def duplicate(rng: Draw, n: int, levels: int) -> list[Level]:
    """Rows appear twice within a level and again in others, some with the same bounds."""
    problem = _hierarchy(rng, n, levels)
    for level in problem:
        for i in range(1, len(level.C), 2):
            level.C[i] = level.C[i - 1]
            if rng.random() < 0.5:
                level.lb[i], level.ub[i] = level.lb[i - 1], level.ub[i - 1]
        for i in range(1, len(level.A), 2):
            level.A[i], level.b[i] = level.A[i - 1], level.b[i - 1]
    for upper, lower in pairwise(problem):
        if len(upper.C) and len(lower.C):
            lower.C[0], lower.lb[0], lower.ub[0] = upper.C[-1], upper.lb[-1], upper.ub[-1]
    return problem


def equal_bounds(rng: Draw, n: int, levels: int) -> list[Level]:
    """Half of the ranges are points, or points but for rounding."""
    problem = _hierarchy(rng, n, levels)
    for level in problem:
        for i in range(0, len(level.C), 2):
            level.lb[i] = rng.normal()
            level.ub[i] = level.lb[i] * (1.0 - rng.choice([0.0, 0.0, 1e-16, 1e-12]) * np.sign(level.lb[i]))
    return problem


def infinite_bounds(rng: Draw, n: int, levels: int) -> list[Level]:
    """Most bounds are infinite, some rows have none."""
    problem = _hierarchy(rng, n, levels)
    for level in problem:
        level.lb[rng.random(len(level.lb)) < 0.6] = -np.inf
        level.ub[rng.random(len(level.ub)) < 0.6] = np.inf
    return problem


def infeasible_level(rng: Draw, n: int, levels: int) -> list[Level]:
    """Rows of one level exclude each other: more equalities than variables, and ranges with gaps between."""
    problem = _hierarchy(rng, n, levels)
    worst = int(rng.integers(levels))
    C = rng.normal(size=(n + 4, n))
    C[1::2] = C[0::2][: len(C[1::2])]
    lb = rng.normal(size=n + 4) + np.where(np.arange(n + 4) % 2, 3.0, -3.0)
    problem[worst] = Level(A=rng.normal(size=(n + 2, n)), b=rng.normal(size=n + 2), C=C, lb=lb, ub=lb + 0.5)
    return problem


def nearly_parallel(rng: Draw, n: int, levels: int) -> list[Level]:
    """Pairs of rows, within a level and between levels, at angles down to 1e-6."""
    problem = _hierarchy(rng, n, levels)
    rows = [row for level in problem for matrix in _matrices(level) for row in matrix]
    for i in range(1, len(rows), 3):
        rows[i][:] = rows[i - 1] + 10.0 ** rng.uniform(-6, -2) * rng.normal(size=n)
    return problem


def badly_scaled(rng: Draw, n: int, levels: int) -> list[Level]:
    """Rows scaled with their bounds by 1e-3 to 1e3."""
    problem = _hierarchy(rng, n, levels)
    for level in problem:
        scale = 10.0 ** rng.uniform(-3, 3, size=len(level.A))
        level.A[:] *= scale[:, None]
        level.b[:] *= scale
        scale = 10.0 ** rng.uniform(-3, 3, size=len(level.C))
        level.C[:] *= scale[:, None]
        level.lb[:] *= scale
        level.ub[:] *= scale
    return problem


def zero_rows(rng: Draw, n: int, levels: int) -> list[Level]:
    """A third of the rows are zero, some with bounds that exclude zero."""
    problem = _hierarchy(rng, n, levels)
    for level in problem:
        for matrix in _matrices(level):
            matrix[rng.random(len(matrix)) < 0.33] = 0.0
    return problem


def degenerate_vertices(rng: Draw, n: int, levels: int) -> list[Level]:
    """Many more rows than variables pass through one point, with small whole coefficients."""
    problem = _hierarchy(rng, n, levels)
    point = rng.integers(-2, 3, size=n).astype(float)
    for level in problem:
        level.C[:] = rng.integers(-1, 2, size=level.C.shape)
        side = rng.random(len(level.C)) < 0.5
        level.lb[:] = np.where(side, level.C @ point, -np.inf)
        level.ub[:] = np.where(side, np.inf, level.C @ point)
        level.A[:] = rng.integers(-1, 2, size=level.A.shape)
    return problem


def unit_rows(rng: Draw, n: int, levels: int) -> list[Level]:
    """Bounds on single variables, each [0, 0], [0, inf], [-inf, 0] or none, beside equalities."""
    problem = _hierarchy(rng, n, levels)
    for p, level in enumerate(problem):
        level.C[:] = np.eye(n)[rng.integers(n, size=len(level.C))]
        kind = rng.integers(4, size=len(level.C))
        level.lb[:] = np.where(kind < 2, 0.0, -np.inf)
        level.ub[:] = np.where(kind % 2 == 0, 0.0, np.inf)
        if p == levels - 1:
            problem[p] = Level(A=np.eye(n), b=np.zeros(n), C=level.C, lb=level.lb, ub=level.ub)
    return problem


def mixed(rng: Draw, n: int, levels: int) -> list[Level]:
    """Each level from another kind."""
    kinds = [kind for kind in KINDS.values() if kind is not mixed]
    return [kinds[rng.integers(len(kinds))](rng, n, levels)[p] for p in range(levels)]


KINDS: dict[str, Callable[[Draw, int, int], list[Level]]] = {
    kind.__name__: kind
    for kind in (
        dense,
        rank_deficient,
        conflicting,
        duplicate,
        equal_bounds,
        infinite_bounds,
        infeasible_level,
        nearly_parallel,
        badly_scaled,
        zero_rows,
        degenerate_vertices,
        unit_rows,
        mixed,
    )
}


def problem(kind: str, seed: int, n: int | None = None, levels: int | None = None) -> list[Level]:
    """A hierarchy of one kind, fixed by its seed; n is 2 to 60 and levels are 1 to 12 where not given."""
    rng = np.random.default_rng([sorted(KINDS).index(kind), seed])
    size, count = int(rng.integers(2, 61)), int(rng.integers(1, 13))
    return KINDS[kind](rng, n or size, levels or count)
