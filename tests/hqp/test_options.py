"""Weights of rows, bounds on x itself, a start and a time limit from the caller."""

import numpy as np
import pytest
from hapticd.hqp import HqpError, Level, Solver, Status, solve
from hapticd.hqp.certificate import certificate, slack_norms
from hapticd.hqp.generate import problem

KINDS = ["dense", "conflicting", "rank_deficient", "friction_pyramids", "no_equalities"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_weight_is_a_row_times_its_root(kind):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        levels = problem(kind, seed, n=10, levels=4)
        weights = [rng.exponential(size=sum(level.rows)) + 0.1 for level in levels]
        weighted = [
            Level(A=lv.A, b=lv.b, C=lv.C, lb=lv.lb, ub=lv.ub, weights=w)
            for lv, w in zip(levels, weights, strict=True)
        ]
        scaled = []
        for lv, w in zip(levels, weights, strict=True):
            of_a, of_c = np.split(np.sqrt(w), [len(lv.A)])
            parts = (of_a[:, None] * lv.A, of_a * lv.b, of_c[:, None] * lv.C, of_c * lv.lb, of_c * lv.ub)
            scaled.append(Level(**dict(zip(("A", "b", "C", "lb", "ub"), parts, strict=True))))
        one, other = solve(weighted), solve(scaled)
        assert one.status is other.status is Status.SOLVED
        np.testing.assert_allclose(one.x, other.x, atol=1e-7 * (1.0 + np.abs(other.x).max()))
        assert certificate(weighted, one.x).max() < 1e-6
        np.testing.assert_allclose(slack_norms(weighted, one.x), slack_norms(scaled, one.x), atol=1e-9)
        for lv, w, v in zip(levels, one.w, one.v, strict=True):
            np.testing.assert_allclose(w, lv.b - lv.A @ one.x, atol=1e-9)
            np.testing.assert_allclose(v, np.clip(lv.C @ one.x, lv.lb, lv.ub) - lv.C @ one.x, atol=1e-9)


def test_weights_are_read_anew_with_each_solve():
    task = Level(A=np.ones((2, 1)), b=np.array([0.0, 3.0]), weights=np.ones(2))
    solver = Solver(1, [task.rows])
    assert solver.solve([task]).x[0] == pytest.approx(1.5)
    task.weights[1] = 2.0
    assert solver.solve([task]).x[0] == pytest.approx(2.0)
    for bad in (0.0, -1.0, np.nan, np.inf):
        task.weights[1] = bad
        assert solver.solve([task]).status is Status.BAD_MATRIX
    assert solver.solve([Level(A=task.A, b=task.b)]).x[0] == pytest.approx(1.5)


def test_weights_of_another_number_are_refused():
    with pytest.raises(HqpError, match="weights has 1 entries and the level has 2 rows"):
        Level(A=np.eye(2), b=np.zeros(2), weights=np.ones(1))


def test_bounds_without_rows_are_bounds_on_x():
    box = Level(lb=np.array([-1.0, 0.0]), ub=np.array([1.0, np.inf]))
    found = solve([box, Level(A=np.eye(2), b=np.array([3.0, -3.0]))])
    np.testing.assert_allclose(found.x, [1.0, 0.0])


@pytest.mark.parametrize("kind", [*KINDS, "degenerate_vertices", "mixed"])
def test_any_start_leads_to_the_same_slacks(kind):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        levels = problem(kind, seed)
        solver = Solver(levels[0].n, [level.rows for level in levels])
        cold = solver.solve(levels).x.copy()
        for start in (cold, cold + 0.01 * rng.normal(size=len(cold)), 100.0 * rng.normal(size=len(cold))):
            solver.start(start)
            found = solver.solve(levels)
            assert found.status is Status.SOLVED and certificate(levels, found.x).max() < 1e-6, seed


def test_a_start_that_is_not_a_point_is_refused_and_changes_nothing():
    levels = [Level(A=np.eye(2), b=np.ones(2))]
    solver = Solver(2, [(2, 0)])
    before = solver.solve(levels).x.copy()
    masked = np.ma.masked_array([1.0, 2.0], [True, False])
    for bad in (np.array([1.0, np.nan]), np.ones(3), "text", None, ["1", "2"], [1j, 2.0], masked):
        with pytest.raises(HqpError, match=r"^x "):
            solver.start(bad)
    np.testing.assert_array_equal(solver.solve(levels).x, before)


def test_a_time_limit_ends_a_solve_with_a_usable_x_and_a_generous_one_changes_no_bit():
    levels = problem("no_equalities", 3, n=60, levels=10)
    free = solve(levels)
    assert free.status is Status.SOLVED and free.iterations > 50
    late = solve(levels, time_limit=1e-9)
    assert late.status is Status.TIME_LIMIT and np.isfinite(late.x).all()
    assert late.levels_done < len(levels) and str(late.status) == "time limit reached"
    np.testing.assert_array_equal(solve(levels, time_limit=1000.0).x, free.x)
    with pytest.raises(HqpError):
        Solver(1, [(1, 0)], time_limit=-1.0)
