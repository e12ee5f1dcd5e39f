"""Random histories of one solver: what is solved must be optimal after each change.

Bounds open and close, rows vanish and come back, levels are exchanged or change from one on; the solver is
started and reset.
"""

import numpy as np
import pytest
from hapticd.hqp import Level, Solver, Status
from hapticd.hqp.certificate import certificate, slack_norms

TICKS = 12


def random_rows(rng, count, n):
    """Unit rows mostly, as of locked joints, and some of small whole numbers."""
    rows = np.eye(n)[rng.integers(n, size=count)] * rng.choice([-1.0, 1.0, 2.0], size=(count, 1))
    whole = rng.integers(-2, 3, size=(count, n)).astype(float)
    return np.where(rng.random((count, 1)) < 0.7, rows, whole)


def random_level(rng, n):
    C = random_rows(rng, int(rng.integers(0, 4)), n)
    lb = rng.integers(-2, 2, size=len(C)).astype(float)
    ub = lb + rng.choice([0.0, 0.0, 1.0, np.inf], size=len(C))
    A = random_rows(rng, int(rng.integers(0 if len(C) else 1, 3)), n)
    return Level(A=A, b=rng.integers(-2, 3, size=len(A)).astype(float), C=C, lb=lb, ub=ub)


def copied(level):
    return Level(A=level.A.copy(), b=level.b.copy(), C=level.C.copy(), lb=level.lb.copy(), ub=level.ub.copy())


def change(rng, levels, first_ones):
    """Change one thing. Returns the first level that is not as it was."""
    k = int(rng.integers(len(levels)))
    level, first = levels[k], first_ones[k]
    if rng.random() < 0.15:
        levels[k] = copied(first)
        return k
    if len(level.lb) and rng.random() < 0.7:
        i = int(rng.integers(len(level.lb)))
        point = float(np.clip(0.0, level.lb[i], level.ub[i]))
        ways = [(point, point), (point, np.inf), (-np.inf, point), (-np.inf, np.inf), (point, point + 1.0)]
        level.lb[i], level.ub[i] = ways[rng.integers(len(ways))]
        if rng.random() < 0.2:
            level.C[i] = 0.0 if level.C[i].any() else first.C[i]
    elif len(level.b):
        i = int(rng.integers(len(level.b)))
        level.b[i] += float(rng.integers(-1, 2))
        if rng.random() < 0.3:
            level.A[i] = 0.0 if level.A[i].any() else first.A[i]
    return k


def solved(rng, solver, levels, first):
    way = rng.random()
    if way < 0.1:
        solver.reset()
    elif way < 0.2:
        solver.start(rng.integers(-2, 3, size=levels[0].n).astype(float))
    elif way < 0.6:
        return solver.resolve(levels, first)
    return solver.solve(levels)


@pytest.mark.parametrize("first_seed", range(0, 2000, 250))
def test_what_is_solved_is_optimal_whatever_came_before(first_seed):
    for seed in range(first_seed, first_seed + 250):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 7))
        levels = [random_level(rng, n) for _ in range(rng.integers(2, 5))]
        first_ones = [copied(level) for level in levels]
        solver = Solver(n, [level.rows for level in levels])
        solver.solve(levels)
        for tick in range(TICKS):
            solution = solved(rng, solver, levels, change(rng, levels, first_ones))
            assert solution.status is Status.SOLVED, (seed, tick)
            assert certificate(levels, solution.x).max() < 1e-9, (seed, tick)


def test_rows_to_fit_that_become_ranges_leave_no_column_fixed():
    C = np.eye(3)[2:]
    held, wish = Level(C=C, lb=np.zeros(1), ub=np.zeros(1)), Level(C=C.copy(), lb=np.ones(1), ub=np.ones(1))
    solver = Solver(3, [held.rows, wish.rows])
    solver.solve([held, wish])
    held.ub[0] = np.inf
    for _ in range(3):
        solution = solver.solve([held, wish])
        assert solution.status is Status.SOLVED and np.allclose(solution.x, [0.0, 0.0, 1.0])


@pytest.mark.parametrize("seed", range(20))
def test_a_row_that_has_become_another_one_is_another_one(seed):
    """Each tick one row changes in place; what was factorised with it before the tick is of no use."""
    rng = np.random.default_rng(seed)
    n, most = int(rng.integers(4, 16)), 4
    levels = []
    for _ in range(4):
        A, C = rng.normal(size=(rng.integers(1, most), n)), rng.normal(size=(rng.integers(1, most), n))
        lb = rng.normal(size=len(C))
        levels.append(Level(A=A, b=rng.normal(size=len(A)), C=C, lb=lb, ub=lb + 0.5))
    solver = Solver(n, [level.rows for level in levels])
    for _ in range(TICKS):
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED
        assert certificate(levels, solution.x).max() <= 1e-8
        k = int(rng.integers(len(levels)))
        matrix = levels[k].A if rng.random() < 0.5 else levels[k].C
        matrix[rng.integers(len(matrix))] += rng.choice([1e-3, 1.0]) * rng.normal(size=n)


def whole_hierarchy(rng, n):
    """Two levels of ranges and one of equalities, of small whole numbers: x is short."""
    levels = []
    for _ in range(2):
        lb = rng.integers(-2, 3, size=3).astype(float)
        C = rng.integers(-3, 4, size=(3, n)).astype(float)
        levels.append(Level(C=C, lb=lb, ub=lb + 2.0))
    A = rng.integers(-3, 4, size=(2, n)).astype(float)
    return [*levels, Level(A=A, b=rng.integers(-4, 5, size=2).astype(float))]


@pytest.mark.parametrize("first_seed", range(0, 400, 100))
def test_where_a_solve_began_leaves_no_trace(first_seed):
    for seed in range(first_seed, first_seed + 100):
        rng = np.random.default_rng(seed)
        levels = whole_hierarchy(rng, 3)
        solver = Solver(3, [level.rows for level in levels])
        least = slack_norms(levels, solver.solve(levels).x)
        for _ in range(20):
            direction = rng.standard_normal(3)
            solver.start(4e6 * direction / np.linalg.norm(direction))
            solution = solver.solve(levels)
            assert solution.status == Status.SOLVED, seed
            np.testing.assert_allclose(slack_norms(levels, solution.x), least, atol=1e-8, err_msg=str(seed))


@pytest.mark.parametrize("cap", [6, 10, 20])
def test_a_cap_holds_for_a_solve_that_begins_far_away(cap):
    solved = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        levels = whole_hierarchy(rng, 3)
        rows = [level.rows for level in levels]
        least = slack_norms(levels, Solver(3, rows).solve(levels).x)
        solver = Solver(3, rows, max_iterations=cap)
        solver.start(4e6 * rng.standard_normal(3))
        solution = solver.solve(levels)
        assert solution.iterations <= cap, seed
        if solution.status == Status.SOLVED:
            solved += 1
            np.testing.assert_allclose(slack_norms(levels, solution.x), least, atol=1e-8, err_msg=str(seed))
    assert solved
