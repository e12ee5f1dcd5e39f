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


def friction_pyramids(rng: Draw, n: int, levels: int) -> list[Level]:
    """Legs on the ground: balance, forces in pyramids and motion in a box, tasks, and rest.

    Tasks pull many forces into the apex of their pyramid, where five rows meet in three variables.
    """
    size = min(3, n)
    contacts = max(1, n // (2 * size))
    motion = n - size * contacts
    balance = rng.normal(size=(min(6, n), n)) * rng.choice([1.0, 10.0, 90.0])
    cones, reach = _pyramids(n, motion, size, rng.uniform(0.3, 1.0)), rng.exponential(30.0)
    box = np.full(motion, rng.exponential(20.0))
    ground = Level(
        C=np.vstack([np.eye(n)[:motion], cones]),
        lb=np.concatenate([-box, np.full(len(cones), -np.inf)]),
        ub=np.concatenate([box, np.zeros(len(cones))]),
    )
    problem = [Level(A=balance, b=balance @ _forces(rng, n, motion, size, reach)), ground]
    while len(problem) < levels - 1:
        rows = rng.normal(size=(int(rng.integers(1, 2 + n // 4)), n)) * (rng.random(n) < 0.5)
        problem.append(Level(A=rows, b=rng.normal(size=len(rows)) * rng.choice([0.1, 1.0, 20.0])))
    rest = np.eye(n)
    problem.append(Level(A=rest, b=rest @ _forces(rng, n, motion, size, reach)))
    return problem[-levels:]


def _pyramids(n: int, motion: int, size: int, friction: float) -> Array:
    """Rows c x <= 0 of forces from variable `motion` on: the last of each `size` is normal to the ground."""
    rows = []
    for normal in range(motion + size - 1, n, size):
        rows.append(-np.eye(n)[normal])
        for tangent in range(normal - size + 1, normal):
            rows += [sign * np.eye(n)[tangent] - friction * np.eye(n)[normal] for sign in (-1.0, 1.0)]
    return np.array(rows)


def _forces(rng: Draw, n: int, motion: int, size: int, reach: float) -> Array:
    """A target whose normal forces are often zero or pull at the ground."""
    target = rng.normal(size=n)
    target[motion:] *= reach
    normal = np.arange(motion + size - 1, n, size)
    target[normal] = np.where(rng.random(len(normal)) < 0.5, np.minimum(target[normal], 0.0), target[normal])
    return target


def boxes_meeting_cones(rng: Draw, n: int, levels: int) -> list[Level]:
    """Bounds on all variables, and cones that have their apex in a corner of this box."""
    corner = rng.choice([-1.0, 1.0], size=n)
    problem = [Level(C=np.eye(n), lb=-np.ones(n), ub=np.ones(n))]
    while len(problem) < levels:
        rows = rng.integers(-1, 2, size=(int(rng.integers(1, n + 2)), n)).astype(float)
        tasks = rng.normal(size=(int(rng.integers(1, 2 + n // 3)), n))
        problem.append(
            Level(
                A=tasks,
                b=tasks @ (corner * rng.choice([1.0, 3.0]))
                + rng.choice([0.0, 1.0]) * rng.normal(size=len(tasks)),
                C=rows,
                lb=np.full(len(rows), -np.inf),
                ub=rows @ corner,
            )
        )
    return problem


def no_equalities(rng: Draw, n: int, levels: int) -> list[Level]:
    """Dense ranges alone, more than there are variables."""
    problem = [_level(rng, n, 0, 1 + int(rng.integers(1, 2 + 2 * n // levels))) for _ in range(levels)]
    for level in problem:
        narrow = np.isfinite(level.lb) & (rng.random(len(level.lb)) < 0.3)
        level.ub[narrow] = level.lb[narrow] + 1e-3
    return problem


def tall(rng: Draw, n: int, levels: int) -> list[Level]:
    """A few levels with many more rows than variables, some of low rank."""
    problem = _hierarchy(rng, n, levels)
    for _ in range(2):
        p, rank = int(rng.integers(levels)), int(rng.integers(1, n + 1))
        high = _level(rng, n, int(rng.integers(3 * n)), int(rng.integers(n, 5 * n)))
        for matrix in _matrices(high):
            matrix[:] = rng.normal(size=(len(matrix), rank)) @ rng.normal(size=(rank, n)) / np.sqrt(rank)
        problem[p] = high
    return problem


def faint_direction(rng: Draw, n: int, levels: int) -> list[Level]:
    """The equalities of a level are more rows than directions, and share one that most hardly see.

    One row sees it by a hundredth, the others by 1e-12 to 1e-7: contacts that do not accelerate, of feet that
    stand in a plane but for their rounding.
    """
    problem = _hierarchy(rng, n, levels)
    point = rng.normal(size=n)
    for p, level in enumerate(problem):
        rank, direction = int(rng.integers(1, 2 + n // levels)), rng.normal(size=n)
        seen = 10.0 ** rng.uniform(-12, -7, size=2 * rank + 1)
        clear = rng.integers(len(seen))
        seen[clear] = 0.01
        rows = rng.normal(size=(len(seen), rank)) @ rng.normal(size=(rank, n)) / np.sqrt(rank)
        rows += np.outer(seen, direction)
        missed = rng.normal(size=len(rows)) * (rng.random() < 0.3)
        missed[clear] = 0.0  # or x would go far
        problem[p] = Level(A=rows, b=rows @ point + missed, C=level.C, lb=level.lb, ub=level.ub)
    return problem


def unseen_variables(rng: Draw, n: int, levels: int) -> list[Level]:
    """Some variables that no row sees, beside rows in small whole numbers that all but repeat one another."""
    problem = _hierarchy(rng, n, levels)
    seen, point = rng.random(n) < 0.7, rng.integers(-2, 3, size=n).astype(float)
    rows = rng.integers(-2, 3, size=(1 + n // 2, n)) * seen
    angle = 10.0 ** rng.uniform(-6, -4)
    for level in problem:
        for matrix in _matrices(level):
            matrix[:] = rows[rng.integers(len(rows), size=len(matrix))]
            matrix *= 1.0 + angle * rng.normal(size=matrix.shape)
        level.b[:] = level.A @ point  # where x would go far otherwise
        level.lb[:], level.ub[:] = (
            np.minimum(level.lb, level.C @ point),
            np.maximum(level.ub, level.C @ point),
        )
        is_point = rng.random(len(level.C)) < 0.3
        level.lb[is_point] = level.ub[is_point] = (level.C @ point)[is_point]
    return problem


def mixed(rng: Draw, n: int, levels: int) -> list[Level]:
    """Each level from another kind of rows."""
    kinds = [kind for kind in OF_ROWS if kind is not mixed]
    return [kinds[rng.integers(len(kinds))](rng, n, levels)[p] for p in range(levels)]


OF_ROWS = (
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
OF_STRUCTURE = (friction_pyramids, boxes_meeting_cones, no_equalities, tall)
OF_ROUNDING = (faint_direction, unseen_variables)
KINDS: dict[str, Callable[[Draw, int, int], list[Level]]] = {
    kind.__name__: kind for kind in (*OF_ROWS, *OF_STRUCTURE, *OF_ROUNDING)
}
NUMBERS = {  # part of the seed, so kinds that come later are numbered later
    name: number
    for number, name in enumerate(
        name
        for kinds in (OF_ROWS, OF_STRUCTURE, OF_ROUNDING)
        for name in sorted(kind.__name__ for kind in kinds)
    )
}


def problem(kind: str, seed: int, n: int | None = None, levels: int | None = None) -> list[Level]:
    """A hierarchy of one kind, fixed by its seed; n is 2 to 60 and levels are 1 to 12 where not given."""
    rng = np.random.default_rng([NUMBERS[kind], seed])
    size, count = int(rng.integers(2, 61)), int(rng.integers(1, 13))
    return KINDS[kind](rng, n or size, levels or count)


def jump(rng: Draw, levels: list[Level]) -> None:
    """The next tick of a problem: rows drift, and now and then the targets of a level jump."""
    for level in levels:
        for matrix in _matrices(level):
            matrix *= 1.0 + 1e-4 * rng.normal(size=matrix.shape)
        leap = rng.choice([0.0, 0.01, 1.0], p=[0.5, 0.3, 0.2])
        level.b[:] += leap * (1.0 + np.abs(level.b)) * rng.normal(size=len(level.b))
