"""One answer whatever the start, where rows are longer than those above, or are held by next to nothing."""

import numpy as np
import pytest
from hapticd.hqp import Level, Solver, Status, solve
from hapticd.hqp.certificate import certificate, slack_norms
from hapticd.hqp.generate import jump, problem

from .test_contacts import DATA, recorded, solver_of, too_large_for_more_digits


def small_ticks(name):
    """Ticks in a row, of levels of any number and size."""
    with np.load(DATA / f"{name}.npz") as file:
        parts = {tuple(key.split("_")): part for key, part in file.items()}
    ticks = {}
    for (tick, level, name), part in parts.items():
        ticks.setdefault(tick, {}).setdefault(level, {})[name] = part
    return [[Level(**found) for found in levels.values()] for levels in ticks.values()]


def one_corner(short, target, long):
    """Level 1 leaves the slack 40 and meets its row of length `short`: x = (-1/3, 0, 1/3) is all that level 2
    can do."""
    return [
        Level(C=np.array([[1.0, 1, -2], [2, 1, 2]]), lb=np.array([-2.0, 0]), ub=np.array([-1.0, 1])),
        Level(
            A=np.array([[-short] * 3, [40, 20, 40]]),
            b=np.array([0.0, -40]),
            C=np.array([[-1.0, 1, 1]]),
            lb=np.zeros(1),
            ub=np.ones(1),
        ),
        Level(A=long * np.array([[-1.0, 3, -2]]), b=np.array([long * target])),
    ]


@pytest.mark.parametrize("short", [1.0, 0.1, 0.01, 1e-3, 1e-4])
@pytest.mark.parametrize("long", [1.0, 10.0])
def test_a_row_that_can_be_met_is_met_however_short_it_is(short, long):
    for target in (20.0, 200.0, 777.0, 2000.0):
        solution = solve(one_corner(short, target, long))
        assert solution.status is Status.SOLVED
        assert np.allclose(solution.x, [-1 / 3, 0, 1 / 3], rtol=0, atol=1e-9)


@pytest.mark.parametrize("long", [1.0, 30.0, 100.0, 1e4])
def test_the_weight_of_a_join_alone_is_no_gain(long):
    """Far starts leave it open whether level 1 leans on a row, and two levels as one are tried."""
    levels = [
        Level(C=np.array([[2.0, -1]]), lb=np.zeros(1), ub=np.ones(1)),
        Level(
            A=np.array([[-4.0, 2]]),
            b=np.array([7.0]),
            C=np.array([[1.0, -1]]),
            lb=-2 * np.ones(1),
            ub=-np.ones(1),
        ),
        Level(A=long * np.array([[2.0, 1]]), b=np.array([-2 * long])),
    ]
    for seed in range(40):
        solver = solver_of(levels)
        solver.start(np.random.default_rng(seed).normal(size=2) * 10.0 ** (seed % 4))
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED and np.allclose(solution.x, [1, 2], rtol=0, atol=1e-9), seed


def rows_in_the_span(rng, factor):
    """Three levels in small whole numbers, each `factor` times longer than the one before; all ask again for
    combinations of the rows above, for other values."""
    n = int(rng.integers(2, 6))
    above = rng.integers(-2, 3, (2, n)).astype(float)
    levels = []
    for p in range(3):
        scale = factor**p
        again = rng.integers(-2, 3, (2, len(above))) @ above
        rows = rng.integers(-2, 3, (int(rng.integers(1, 4)), n)).astype(float)
        lb = rng.integers(-2, 2, len(rows)).astype(float)
        ub = lb + rng.integers(0, 3, len(rows))
        b = rng.integers(-9, 10, 2).astype(float)
        levels.append(Level(A=scale * again, b=scale * b, C=scale * rows, lb=scale * lb, ub=scale * ub))
        above = np.vstack([above, rows])
    return levels


@pytest.mark.parametrize(("factor", "known"), [(10.0, (2262, 2411)), (100.0, (574, 731, 969, 1245))])
def test_longer_rows_below_leave_one_answer_from_any_of_these_starts(factor, known):
    for seed in (*range(100), *known):
        rng = np.random.default_rng([seed, int(factor)])
        levels = rows_in_the_span(rng, factor)
        norms = []
        for k in range(4):
            solver = solver_of(levels)
            if k:
                solver.start(rng.normal(size=solver.n) * 10.0**k)
            solution = solver.solve(levels)
            assert solution.status is Status.SOLVED, seed
            norms.append(slack_norms(levels, solution.x))
        assert all(np.allclose(other, norms[0], rtol=1e-6, atol=1e-6) for other in norms), seed


@pytest.mark.parametrize("tick", range(3))
def test_an_answer_that_is_proven_exactly_stands_before_one_that_is_not(tick):
    """Level 6 holds a row by so little that an answer that leaves it is proven to 1e-9, too."""
    levels = recorded("contact_exact")[tick]
    norms = []
    for scale in (0.0, 1.0, 1000.0):
        solver = solver_of(levels)
        solver.start(scale * np.random.default_rng(tick).normal(size=solver.n))
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED and certificate(levels, solution.x)[5] < 1e-14
        norms.append(slack_norms(levels, solution.x))
    assert np.allclose(norms, norms[0], rtol=1e-7, atol=1e-7)


def test_what_cannot_be_proven_exactly_is_not_looked_for_again():
    """The walk meets the answer, of which level 7 leaves 1e-10: it is proven where it was met."""
    levels = recorded("contact_close")[0]
    solution = solve(levels)
    assert solution.status is Status.SOLVED and certificate(levels, solution.x).max() < 1e-6
    assert solution.iterations < 400


@pytest.mark.parametrize(("name", "last"), [("contact_last", 441.1238), ("contact_undecided", 477.6662)])
def test_what_doubles_leave_unproven_is_solved_with_more_digits_and_alike_from_any_start(name, last):
    """Levels 6 to 8 have a slack, and each is held by multipliers of 1e9 and more of those before."""
    levels = recorded(name)[0]
    norms = []
    for scale in (0.0, 1.0, 1000.0):
        solver = solver_of(levels)
        solver.start(scale * np.random.default_rng(1).normal(size=solver.n))
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED and solution.levels_done == len(levels)
        assert certificate(levels, solution.x).max() < 1e-6
        norms.append(slack_norms(levels, solution.x))
        again = solver.solve(levels)
        assert again.status is Status.SOLVED and np.allclose(
            slack_norms(levels, again.x), norms[-1], rtol=1e-9
        )
    assert np.allclose(norms, norms[0], rtol=1e-9, atol=1e-9)
    assert norms[0][-1] == pytest.approx(last, abs=1e-3)


def test_more_digits_keep_to_the_iterations_and_to_the_time_that_are_left():
    levels = recorded("contact_last")[0]
    needed = solve(levels).iterations
    for most in (needed - 1, needed // 2, 1):
        cut = solve(levels, max_iterations=most)
        assert cut.status is Status.ITERATION_CAP and cut.iterations <= most + 1
        assert np.isfinite(cut.x).all() and cut.levels_done < len(levels)
    assert solve(levels, time_limit=1e-9).status is Status.TIME_LIMIT
    assert solve(levels, time_limit=100.0).status is Status.SOLVED


def test_a_level_that_hardly_sees_a_direction_is_met_where_it_can_be_whatever_the_start():
    """Level 2 sees one direction by 3e-7, along which x = (-3, -2, -3, 2, 0) meets all: fitted at its other
    bound its range leaves 7e-7 of its equations, and 2.7 of level 3, and no gradient to speak of."""
    tiny = 2.0**-17
    near = [
        [2 * tiny, -2 - tiny, -1 - tiny, tiny, 2 * tiny],
        [-2.0, 0, 0, 4, 0],
        [-4 * tiny, -10 + 4 * tiny, -3 + 4 * tiny, 0, -2 - 4 * tiny],
    ]
    met = np.array([-3.0, -2, -3, 2, 0])
    rows = np.array([[0.0, 2, 1, 0, 0], [0, 2, 0, 0, 1]]), np.array(near), np.array([[0.0, 0, -2, 0, -4]])
    between = {"C": np.array([[3.0, 0, -1, 0, -4]]), "lb": np.array([-9.0]), "ub": np.array([-6.0])}
    levels = [
        Level(A=rows[0], b=rows[0] @ met),
        Level(A=rows[1], b=rows[1] @ met, **between),
        Level(A=rows[2], b=rows[2] @ met),
    ]
    solver = solver_of(levels)
    for seed in range(40):
        solver.start(3.0 * np.random.default_rng(seed).normal(size=5))
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED and slack_norms(levels, solution.x).max() < 1e-6, seed


def test_what_is_found_with_more_digits_leaves_free_what_no_row_sees():
    levels = [
        Level(
            **{name: np.pad(getattr(level, name), ((0, 0), (0, 2))) for name in "AC"},
            b=level.b,
            lb=level.lb,
            ub=level.ub,
        )
        for level in recorded("contact_last")[0]
    ]
    solver = solver_of(levels)
    start = np.zeros(solver.n)
    start[-2:] = 3.0, -4.0
    solver.start(start)
    solution = solver.solve(levels)
    assert solution.status is Status.SOLVED and not solution.unique
    assert solution.x[-2:].tolist() == [3.0, -4.0]


def test_an_x_that_a_warm_solve_makes_very_long_is_looked_for_from_cold():
    """By nearly parallel rows: 3.7e7; from cold it is 1.8e4."""
    seed = 7002375
    levels = problem("nearly_parallel", seed)
    solver = solver_of(levels)
    solver.solve(levels)
    jump(np.random.default_rng(seed), levels)
    solution = solver.solve(levels)
    assert solution.status is Status.SOLVED and certificate(levels, solution.x).max() < 1e-9
    assert np.linalg.norm(solution.x) < 1e5


def test_a_join_by_a_small_weight_leads_to_the_next_answer():
    """Levels 7 and 8 are proven as one, by 2^-32, and by doubles not apart: the second tick begins with that,
    once the first try has found no better."""
    ticks = [too_large_for_more_digits(levels) for levels in recorded("contact_streak")]
    solver = solver_of(ticks[0])
    for levels in ticks:
        warm, cold = solver.solve(levels), solve(levels)
        assert warm.status is cold.status is Status.SOLVED
        assert certificate(levels, warm.x).max() < 1e-6
        norms = [slack_norms(levels, solution.x) for solution in (warm, cold)]
        np.testing.assert_allclose(*norms, rtol=1e-6, atol=1e-9)
    assert warm.iterations < 100 < cold.iterations


def test_multipliers_that_are_all_rounding_prove_nothing():
    """Level 7 meets its own equation to the last digit: times 5e12 that passed for what holds level 8."""
    ticks = recorded("contact_vain")
    solver = solver_of(ticks[0])
    for levels in ticks:
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED and certificate(levels, solution.x).max() < 1e-6
    assert slack_norms(levels, solution.x)[-1] == pytest.approx(484.129, abs=1e-3)


def test_an_x_that_is_too_long_for_the_rounding_of_a_row_is_not_called_solved():
    """Of x = 1e14 rows saw next to nothing, and so no rounding, while their tolerances grow with |x|."""
    ticks = small_ticks("long_x")
    solver = solver_of(ticks[0])
    for levels in ticks:
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED and certificate(levels, solution.x).max() < 1e-6


def test_a_long_row_that_is_all_but_met_does_not_hide_what_short_ones_lack():
    """Level 1 has a row of length 3000, missed by 1e-4, beside rows of length 15, missed by 4: at the scale
    of the first 3.74276 is as good as 3.74271."""
    ticks = small_ticks("spread_rows")
    solver = solver_of(ticks[0])
    for levels in ticks:
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED
    assert slack_norms(levels, solution.x)[-1] == pytest.approx(3.7427145, abs=1e-7)


@pytest.mark.parametrize(
    ("problem", "least", "solved"), [(0, 0.0071664945, 40), (1, 0.0010596933, 40), (2, 0.0044243845, 8)]
)
def test_the_rounding_of_long_rows_does_not_hide_what_short_ones_lack(problem, least, solved):
    """Lengths times the root of weights go from 1e-3 to 1e4 within a level. From 17, 111 and 121 of 200
    starts the last level ended higher: a row that the way down leaves was at its bound, but for rounding."""
    levels = small_ticks("long_rows")[problem]
    solutions = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        solver = solver_of(levels)
        solver.start(rng.normal(size=solver.n) * 10 ** rng.uniform(-2, 2))
        solutions.append(solver.solve(levels))
    ends = [slack_norms(levels, solution.x)[-1] for solution in solutions if solution.status is Status.SOLVED]
    assert len(ends) >= solved and ends == pytest.approx([least] * len(ends), abs=1e-9)


def test_the_unique_x_is_known_to_be_so_where_the_walk_found_it(recordings):
    """Variables that were fixed ahead of their turn count."""
    recording = recordings["excavator"]
    solver = Solver(recording.x.shape[1], [level.rows for level in recording.levels(0)])
    for tick, levels in recording.replay():
        if tick in (398, 402, 409, 412, 419):
            solver.reset()
            assert solver.solve(levels).unique


def small_integers(rng, n=5, levels=3):
    """Levels of two equalities and two ranges in whole numbers, of which none sees the first variable."""
    found = []
    for _ in range(levels):
        A, C = rng.integers(-3, 4, (2, 2, n)).astype(float)
        A[:, 0] = C[:, 0] = 0.0
        lb = rng.integers(-3, 3, 2).astype(float)
        found.append(Level(A=A, b=rng.integers(-3, 4, 2).astype(float), C=C, lb=lb, ub=lb + 1.0))
    return found


@pytest.mark.parametrize("length", [1e6, 1e9, 1e12, 1e18, 1e60, 1e150, 1e300])
def test_a_start_from_afar_costs_no_accuracy(length):
    for seed in range(60):
        rng = np.random.default_rng(seed)
        levels = small_integers(rng)
        solver = solver_of(levels)
        solver.start(length * rng.normal(size=solver.n))
        far, near = solver.solve(levels), solve(levels)
        assert far.status is near.status is Status.SOLVED, seed
        np.testing.assert_allclose(
            slack_norms(levels, far.x), slack_norms(levels, near.x), rtol=1e-6, atol=1e-6
        )


@pytest.mark.parametrize("target", [1e8, 1e12, 1e16, 1e20, 1e30, 1e99])
def test_a_tick_of_absurd_targets_leaves_nothing_behind(target):
    for seed in range(60):
        rng = np.random.default_rng(seed)
        levels = small_integers(rng)
        solver, best = solver_of(levels), slack_norms(levels, solve(levels).x)
        b = levels[rng.integers(len(levels))].b
        for value in (b[0], target, b[0]):
            b[0] = value
            solution = solver.solve(levels)
        assert solution.status is Status.SOLVED, seed
        np.testing.assert_allclose(slack_norms(levels, solution.x), best, rtol=1e-6, atol=1e-6)


def doubly_stochastic(units, target):
    """The matrix [[a, 1 - a], [1 - a, a]] next to target (4,), each entry in a unit of its own."""
    sums = np.array([[1.0, 1, 0, 0], [0, 0, 1, 1], [1, 0, 1, 0], [0, 1, 0, 1]])
    return [
        Level(C=np.diag(units), lb=np.zeros(4), ub=np.full(4, np.inf)),
        Level(A=sums * units, b=np.ones(4)),
        Level(A=np.diag(units), b=target),
    ]


def test_a_way_down_that_rows_hardly_see_is_gone_where_it_leads_far():
    rng = np.random.default_rng(0)
    for _ in range(1000):
        units, target = 10.0 ** rng.integers(-3, 4, 4), rng.normal(size=4)
        a = np.clip((target[0] + (1 - target[1]) + (1 - target[2]) + target[3]) / 4, 0, 1)
        levels = doubly_stochastic(units, target)
        solver = Solver(4, [level.rows for level in levels])
        solver.start(rng.normal(size=4))
        for solution in (solve(levels), solver.solve(levels)):
            assert solution.status is Status.SOLVED
            assert np.allclose(units * solution.x, [a, 1 - a, 1 - a, a], rtol=0, atol=1e-6)


def test_a_row_that_sees_nothing_that_is_free_holds_nothing():
    """Five legs whose forces are in units from 1e-3 to 1e3: in the metric of the fitted rows, rounding of a
    row that others have settled looks like a direction."""
    (levels,) = small_ticks("blind_row")
    rng = np.random.default_rng(0)
    solver = Solver(15, [level.rows for level in levels])
    for _ in range(50):
        solver.start(rng.normal(size=15) * 10.0 ** rng.integers(-2, 5))
        for solution in (solve(levels), solver.solve(levels)):
            assert solution.status is Status.SOLVED
            slacks = slack_norms(levels, solution.x)
            assert np.allclose(slacks, [0, 0, 438.750813, 338.287671, 270.109295], rtol=1e-8, atol=1e-7)
