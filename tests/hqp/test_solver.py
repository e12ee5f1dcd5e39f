import subprocess
import sys

import numpy as np
import pytest
from hapticd.hqp import HqpError, Level, Solver, Status, solve
from hapticd.hqp.certificate import certificate, slack_norms
from hapticd.hqp.generate import KINDS, problem


def equalities(A, b):
    return Level(A=np.array(A, dtype=float), b=np.array(b, dtype=float))


def ranges(C, lb, ub):
    return Level(C=np.array(C, dtype=float), lb=np.array(lb, dtype=float), ub=np.array(ub, dtype=float))


def fresh(levels, **settings):
    return Solver(levels[0].n, [level.rows for level in levels], **settings)


def test_one_equality_is_met_by_the_shortest_x():
    solution = solve([equalities([[3.0, 4.0]], [25.0])])
    assert np.allclose(solution.x, [3.0, 4.0], atol=1e-14)
    assert solution.status is Status.SOLVED and not solution.unique


def test_a_lower_level_yields_to_an_upper_one():
    solution = solve([equalities([[1.0]], [1.0]), equalities([[1.0]], [3.0])])
    assert solution.x == pytest.approx([1.0])
    assert solution.w[0] == pytest.approx([0.0]) and solution.w[1] == pytest.approx([2.0])
    assert solution.unique


def test_slack_is_what_brings_a_row_into_its_bounds():
    solution = solve([equalities(np.eye(3), [5.0, -5.0, 0.5]), ranges(np.eye(3), [-1] * 3, [1] * 3)])
    assert np.allclose(solution.v[1], [-4.0, 4.0, 0.0])
    assert solution.active[1].tolist() == [1, -1, 0]


def test_conflicting_rows_of_one_level_share_the_slack():
    solution = solve([ranges([[1.0], [1.0]], [2.0, -np.inf], [np.inf, 0.0])])
    assert solution.x == pytest.approx([1.0])
    assert solution.v[0] == pytest.approx([1.0, -1.0])


def test_what_need_not_move_does_not_move():
    solver = Solver(2, [(1, 0)])
    levels = [equalities([[1.0, 0.0]], [1.0])]
    solver.solve(levels)
    levels[0].A[:] = [[0.0, 1.0]]
    assert np.allclose(solver.solve(levels).x, [1.0, 1.0])


def test_equal_bounds_are_an_equality():
    as_range = solve([ranges([[1.0, 2.0]], [3.0], [3.0]), equalities(np.eye(2), [0.0, 0.0])])
    as_equality = solve([equalities([[1.0, 2.0]], [3.0]), equalities(np.eye(2), [0.0, 0.0])])
    assert np.allclose(as_range.x, as_equality.x, atol=1e-14)
    assert as_range.active[0].tolist() == [1]


def test_bounds_crossed_by_rounding_close_to_a_point_between_them():
    solution = solve([ranges([[1.0]], [1000.0], [1000.0 - 1e-7])])
    assert solution.status is Status.SOLVED
    assert 1000.0 - 1e-7 <= solution.x[0] <= 1000.0


def test_a_zero_row_keeps_its_slack_and_is_never_active():
    levels = [ranges([[0.0, 0.0]], [1.0], [2.0]), equalities(np.eye(2), [3.0, 4.0])]
    solution = solve(levels)
    assert np.allclose(solution.x, [3.0, 4.0])
    assert solution.v[0].tolist() == [1.0] and solution.active[0].tolist() == [0]


def test_the_solution_is_the_solvers_own_and_holds_until_the_next_call():
    solver = Solver(1, [(1, 0)])
    levels = [equalities([[1.0]], [1.0])]
    first = solver.solve(levels)
    levels[0].b[0] = 2.0
    assert solver.solve(levels) is first and first.x[0] == 2.0


def test_arrays_are_bound_again_for_another_sequence():
    solver = Solver(1, [(1, 0)])
    assert solver.solve([equalities([[1.0]], [1.0])]).x[0] == 1.0
    assert solver.solve([equalities([[1.0]], [7.0])]).x[0] == 7.0


def test_levels_of_another_shape_are_refused_with_both_shapes():
    solver = Solver(2, [(1, 0)])
    with pytest.raises(HqpError, match=r"\(\(2, 0\),\).*made for \(\(1, 0\),\)"):
        solver.solve([equalities(np.eye(2), [0.0, 0.0])])
    with pytest.raises(HqpError, match=r"3 columns.*n = 2"):
        solver.solve([equalities([[1.0, 0.0, 0.0]], [0.0])])
    with pytest.raises(HqpError, match="empty"):
        solve([])


@pytest.mark.parametrize(
    "arguments",
    [(0, [(1, 0)]), (1025, [(1, 0)]), (2, []), (2, [(16385, 0)]), (2, [(-1, 0)]), (2, [(1, 1)] * 257)],
)
def test_a_size_out_of_range_is_refused(arguments):
    with pytest.raises(HqpError, match="out of range"):
        Solver(*arguments)


@pytest.mark.parametrize(
    "setting", [{"feasibility": 0.0}, {"rank": 1.0}, {"rounding": -1.0}, {"max_iterations": -1}]
)
def test_a_setting_out_of_range_is_refused(setting):
    with pytest.raises(HqpError, match=f"^{next(iter(setting))} is -?[0-9.]+; take "):
        Solver(2, [(1, 0)], **setting)


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("angle", [1e-5, 1e-4, 1e-2])
def test_rows_at_a_smaller_angle_than_rank_are_one_row(n, angle):
    """They are missed by less than counts, so that nobody looks for another rank."""
    rows = np.array([[1.0, 0.0, 0.0], [1.0, angle, 0.0]])
    levels = [Level(A=rows[:, :n].copy(), b=np.array([0.0, 1e-10]))]
    assert solve(levels, rank=0.1 * angle).x[1] == pytest.approx(1e-10 / angle, rel=1e-6)
    assert abs(solve(levels, rank=10.0 * angle).x[1]) <= 1e-10 * angle


def nearly_dependent(errors):
    """Five rows over five variables, told apart by `errors` alone: all but one can be met."""
    e1, e2, e3, e4, e5 = errors
    C = np.array([[-2 - e1, 1 + e2, 0, 0, 0], [0, 0, -2 - e3, 2 + e4, 2 - e5], [0, 2.0, 0, 0, 0]])
    bounds = np.array([-0.927, -1.7786, -3.8717]), np.array([-0.927, -1.7786, np.inf])
    A = np.array([[2.0, -1, 0, 0, 0], [0, -2, 1, 0, 0]])
    return [Level(C=C, lb=bounds[0], ub=bounds[1]), Level(A=A, b=np.array([0.61, -1.341]))]


@pytest.mark.parametrize("unseen", [0, 1, 3, 5])
def test_a_variable_that_no_row_sees_stays_and_changes_nothing(unseen):
    """By rounding it would go on the farther, to 1e15, the less the rows differ."""
    for seed in range(200):
        rng = np.random.default_rng(seed)
        levels = nearly_dependent(10.0 ** rng.uniform(-8, -4) * rng.normal(size=5))
        wider = [
            Level(A=np.insert(p.A, unseen, 0, 1), b=p.b, C=np.insert(p.C, unseen, 0, 1), lb=p.lb, ub=p.ub)
            for p in levels
        ]
        solver, start = Solver(6, [level.rows for level in wider]), rng.normal(size=6)
        solver.start(start)
        found = solver.solve(wider)
        assert found.status is Status.SOLVED and found.x[unseen] == start[unseen]
        solver.reset()
        cold, without = solver.solve(wider), solve(levels)
        assert cold.status is without.status is Status.SOLVED
        np.testing.assert_allclose(
            slack_norms(wider, cold.x), slack_norms(levels, without.x), rtol=1e-6, atol=1e-6
        )
        assert cold.x[unseen] == 0.0 and not cold.unique


def test_a_variable_that_is_seen_no_more_and_again_is_as_in_a_new_solver():
    rng = np.random.default_rng(3)
    level = Level(A=rng.normal(size=(4, 5)), b=rng.normal(size=4))
    solver = Solver(5, [level.rows])
    kept = level.A[:, 2].copy()
    for column in (kept, np.zeros(4), kept):
        level.A[:, 2] = column
        warm = solver.solve([level])
        assert warm.status is Status.SOLVED and np.abs(level.A @ warm.x - level.b).max() < 1e-12


@pytest.mark.parametrize(
    ("part", "value", "status"),
    [
        ("A", np.nan, Status.BAD_MATRIX),
        ("A", np.inf, Status.BAD_MATRIX),
        ("b", np.nan, Status.BAD_MATRIX),
        ("b", -np.inf, Status.BAD_MATRIX),
        ("C", np.nan, Status.BAD_MATRIX),
        ("C", 1e200, Status.BAD_MATRIX),
        ("lb", np.nan, Status.BAD_BOUNDS),
        ("ub", np.nan, Status.BAD_BOUNDS),
        ("lb", np.inf, Status.BAD_BOUNDS),
        ("ub", -np.inf, Status.BAD_BOUNDS),
        ("lb", 1e6, Status.BAD_BOUNDS),
    ],
)
def test_bad_data_give_a_status_the_level_and_the_last_good_x(part, value, status):
    levels = problem("dense", 3, n=8, levels=3)
    levels[1] = Level(A=np.ones((1, 8)), b=np.ones(1), C=np.eye(2, 8), lb=-np.ones(2), ub=np.ones(2))
    solver = fresh(levels)
    good = solver.solve(levels).x.copy()
    getattr(levels[1], part).flat[0] = value
    bad = solver.solve(levels)
    assert bad.status is status and bad.bad_level == 1
    assert bad.x.tobytes() == good.tobytes()
    assert all(np.isnan(w).all() for w in bad.w) and not any(a.any() for a in bad.active)
    getattr(levels[1], part).flat[0] = 1.0 if part == "ub" else 0.5
    assert solver.solve(levels).status is Status.SOLVED
    assert certificate(levels, solver.solve(levels).x).max() < 1e-9


def test_bounds_contradict_where_their_difference_is_beyond_the_largest_number():
    level = Level(lb=np.array([1e308]), ub=np.array([-1e308]))
    assert solve([level]).status is Status.BAD_BOUNDS


@pytest.mark.parametrize(
    ("entry", "weight", "status"),
    [(1e101, 1e-4, Status.BAD_MATRIX), (1e60, 1e100, Status.BAD_MATRIX), (1e49, 1e100, Status.SOLVED)],
)
def test_an_entry_is_absurd_with_its_weight_and_without(entry, weight, status):
    level = Level(A=np.array([[entry, 1.0]]), b=np.ones(1), weights=np.array([weight]))
    assert solve([level]).status is status


def test_a_solution_that_overflows_is_refused():
    solution = solve([equalities([[1e-99]], [1e99]), equalities([[1e99]], [0.0])])
    assert np.isfinite(solution.x).all()


def test_the_iteration_cap_is_kept_and_upper_levels_stay_optimal():
    for seed in range(20):
        levels = problem("dense", seed, n=30, levels=5)
        solution = solve(levels, max_iterations=1)
        assert solution.iterations <= 1
        assert np.isfinite(solution.x).all()
        if solution.status is Status.ITERATION_CAP:
            done = solution.levels_done
            assert done < 5 and certificate(levels, solution.x)[:done].max(initial=0.0) < 1e-8
            break
    else:
        raise AssertionError("no problem reached the cap")


@pytest.mark.parametrize("kind", KINDS)
def test_warm_and_cold_agree_while_the_data_drift(kind):
    for seed in range(8):
        rng = np.random.default_rng(seed)
        levels = problem(kind, seed)
        solver = fresh(levels)
        for _ in range(4):
            warm = slack_norms(levels, solver.solve(levels).x)
            cold = slack_norms(levels, solve(levels).x)
            if kind not in (
                "nearly_parallel",
                "mixed",
            ):  # slacks of lower levels hang on the last digits of upper ones
                assert np.all(np.abs(warm - cold) <= 1e-6 * (1.0 + cold))
            assert certificate(levels, solver.solve(levels).x).max() < 1e-6
            for level in levels:
                level.A[:] *= 1.0 + 1e-3 * rng.normal()
                level.b[:] += 1e-2 * rng.normal(size=len(level.b))
                level.C[:] *= 1.0 + 1e-3 * rng.normal(size=(len(level.C), 1))


def chain(seed):
    """An equality level, ranges, fixings that leave one freedom, and a wish."""
    rng = np.random.default_rng(seed)
    C = rng.normal(size=(2, 12))
    reach = rng.choice([0.1, 5.0])
    return [
        equalities(rng.normal(size=(3, 12)), rng.normal(size=3)),
        ranges(C, [reach, -np.inf], [np.inf, -reach]),
        equalities(2.0 * np.eye(12)[3:11], rng.normal(size=8)),
        equalities(np.eye(12), rng.normal(size=12)),
    ]


def test_fixings_of_variables_yield_to_what_stands_above_them():
    kept = []
    for seed in range(40):
        levels = chain(seed)
        solver = fresh(levels)
        for tick in range(3):
            solution = solver.solve(levels)
            assert solution.status is Status.SOLVED and solution.unique
            assert certificate(levels, solution.x).max() < 1e-9, (seed, tick)
            kept.append(np.linalg.norm(solution.w[2]) < 1e-9)
            levels[1].lb[0] += 0.2
    assert 20 < sum(kept) < 100  # both happen


def test_a_level_that_fixings_below_it_would_spoil_is_met():
    rng = np.random.default_rng(5)
    levels = [
        equalities(rng.normal(size=(3, 4)), rng.normal(size=3)),
        equalities(np.eye(4)[:2], rng.normal(size=2)),
        equalities(np.eye(4), np.zeros(4)),
    ]
    solution = solve(levels)
    assert np.allclose(solution.w[0], 0.0, atol=1e-12) and np.linalg.norm(solution.w[1]) > 0.1
    assert certificate(levels, solution.x).max() < 1e-12


def test_fixings_that_exclude_each_other_share_the_slack():
    levels = [
        equalities([[1.0, 1.0, 0.0, 0.0]], [2.0]),
        equalities([[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], [0.0, 1.0, 5.0]),
        equalities(np.eye(4), np.zeros(4)),
    ]
    solution = solve(levels)
    assert np.allclose(solution.x, [0.5, 1.5, 5.0, 0.0], atol=1e-12)


def test_a_fixing_is_kept_when_later_levels_change():
    for seed in range(20):
        levels = chain(seed)
        solver = fresh(levels)
        solver.solve(levels)
        for first in (3, 2, 3, 1, 4, 3):
            for level in levels[first:]:
                level.b[:] += np.random.default_rng(first).normal(size=len(level.b))
                level.lb[:] += 0.5
            solution = solver.resolve(levels, first)
            assert certificate(levels, solution.x).max() < 1e-9, (seed, first)


def test_fixings_open_and_close_as_later_levels_change():
    rng = np.random.default_rng(8)
    for seed in range(20):
        levels = chain(seed)
        fixed = np.zeros(8)
        levels[2] = ranges(np.eye(12)[3:11], fixed, fixed.copy())
        solver = fresh(levels)
        solver.solve(levels)
        for share in (0.0, 1.0, 0.5, 0.1):
            is_open = rng.random(8) >= share
            levels[2].lb[:] = np.where(is_open & (rng.random(8) < 0.5), -np.inf, 0.0)
            levels[2].ub[:] = np.where(is_open, np.inf, 0.0)
            solution = solver.resolve(levels, 2)
            assert certificate(levels, solution.x).max() < 1e-9, (seed, share)


@pytest.mark.parametrize("kind", KINDS)
def test_resolving_later_levels_is_solving_all(kind):
    for seed in range(8):
        rng = np.random.default_rng(seed)
        levels = problem(kind, seed)
        solver = fresh(levels)
        solver.solve(levels)
        for _ in range(4):
            first = int(rng.integers(len(levels) + 1))
            for level in levels[first:]:
                shift = rng.normal(size=len(level.lb))
                level.lb[:] += shift
                level.ub[:] += shift
                level.b[:] += rng.normal(size=len(level.b))
            solution = solver.resolve(levels, first)
            assert solution.status is Status.SOLVED
            assert certificate(levels, solution.x).max() < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_appending_a_level_leaves_the_upper_slacks_unchanged(kind):
    for seed in range(4):
        levels = problem(kind, seed, n=12, levels=6)
        upper = slack_norms(levels[:5], solve(levels[:5]).x)
        assert np.allclose(slack_norms(levels, solve(levels).x)[:5], upper, rtol=1e-6, atol=1e-6)


def rows_of(level, eq, ineq):
    """The level with these of its equalities and inequalities."""
    return Level(A=level.A[eq], b=level.b[eq], C=level.C[ineq], lb=level.lb[ineq], ub=level.ub[ineq])


# slacks of lower levels hang on the last digits of upper ones where rows are nearly parallel
STEADY = [kind for kind in KINDS if kind not in ("nearly_parallel", "mixed")]


@pytest.mark.parametrize("kind", STEADY)
def test_the_order_of_rows_changes_no_slack(kind):
    for seed in range(8):
        rng = np.random.default_rng(seed)
        levels = problem(kind, seed, n=10, levels=4)
        shuffled = [
            rows_of(level, rng.permutation(len(level.A)), rng.permutation(len(level.C))) for level in levels
        ]
        expected = slack_norms(levels, solve(levels).x)
        assert np.allclose(slack_norms(shuffled, solve(shuffled).x), expected, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("kind", STEADY)
def test_a_level_given_twice_over_weighs_its_slack_twice(kind):
    for seed in range(8):
        levels = problem(kind, seed, n=10, levels=4)
        twice = [
            rows_of(level, np.repeat(np.arange(len(level.A)), 2), np.repeat(np.arange(len(level.C)), 2))
            for level in levels
        ]
        expected = np.sqrt(2.0) * slack_norms(levels, solve(levels).x)
        assert np.allclose(slack_norms(twice, solve(twice).x), expected, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("kind", STEADY)
def test_rows_repeated_in_a_lower_level_change_no_upper_slack(kind):
    for seed in range(8):
        levels = problem(kind, seed, n=10, levels=3)
        expected = slack_norms(levels, solve(levels).x)
        repeated = [levels[0], levels[1], levels[0], levels[2]]
        found = slack_norms(repeated, solve(repeated).x)
        assert np.allclose(found, expected[[0, 1, 0, 2]], rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("kind", ["equal_bounds", "unit_rows"])
def test_a_point_may_be_given_as_two_one_sided_ranges(kind):
    points = 0
    for seed in range(12):
        levels = problem(kind, seed, n=20, levels=4)
        split = []
        for level in levels:
            point = level.lb == level.ub
            split.append(
                Level(
                    A=level.A,
                    b=level.b,
                    C=np.vstack([level.C, level.C[point]]),
                    lb=np.concatenate([level.lb, np.full(point.sum(), -np.inf)]),
                    ub=np.concatenate([np.where(point, np.inf, level.ub), level.ub[point]]),
                )
            )
        points += sum(len(level.C) for level in split) - sum(len(level.C) for level in levels)
        expected = slack_norms(levels, solve(levels).x)
        assert np.allclose(slack_norms(split, solve(split).x), expected, rtol=1e-7, atol=1e-7)
    assert points > 20


def test_scaling_x_changes_no_slack():
    for seed in range(20):
        scale = 10.0 ** np.random.default_rng(seed).uniform(-2, 2, size=10)
        levels = problem("dense", seed, n=10, levels=4)
        scaled = [Level(A=lv.A * scale, b=lv.b, C=lv.C * scale, lb=lv.lb, ub=lv.ub) for lv in levels]
        expected = slack_norms(levels, solve(levels).x)
        assert np.allclose(slack_norms(scaled, solve(scaled).x), expected, rtol=1e-7, atol=1e-7)


def test_reset_forgets_everything():
    for seed in range(20):
        levels = problem("conflicting", seed, n=15, levels=4)
        solver = fresh(levels)
        solver.solve(levels)
        for level in levels:
            level.b[:] += 1.0
        solver.reset()
        assert solver.solve(levels).x.tobytes() == fresh(levels).solve(levels).x.tobytes()


def test_resolving_after_a_reset_solves_all_levels():
    levels = problem("dense", 1, n=15, levels=4)
    solver = fresh(levels)
    solver.solve(levels)
    solver.reset()
    levels[0].b[:] += 1.0
    assert certificate(levels, solver.resolve(levels, 3).x).max() < 1e-9


def shifted(array, offset):
    """A copy whose memory begins `offset` bytes behind a multiple of 64."""
    space = np.empty(array.nbytes + 128, dtype=np.uint8)
    start = -space.ctypes.data % 64 + offset
    copy = space[start : start + array.nbytes].view(array.dtype).reshape(array.shape)
    copy[...] = array
    return copy


@pytest.mark.parametrize("kind", KINDS)
def test_the_alignment_of_the_data_changes_no_bit(kind):
    levels = problem(kind, 1)
    expected = solve(levels)
    for offset in (0, 8, 24, 56):
        moved = [
            Level(**{name: shifted(getattr(level, name), offset) for name in ("A", "b", "C", "lb", "ub")})
            for level in levels
        ]
        found = solve(moved)
        for ours, theirs in zip(
            (found.x, *found.w, *found.v), (expected.x, *expected.w, *expected.v), strict=True
        ):
            assert ours.tobytes() == theirs.tobytes()


ANSWERS = """
import hashlib, sys
import numpy as np
from hapticd.hqp import Solver
from hapticd.hqp.generate import KINDS, problem
digest = hashlib.sha256()
padding = [np.empty(int(sys.argv[1])) for _ in range(100)]
for kind in KINDS:
    for seed in range(3):
        levels = problem(kind, seed)
        solver = Solver(levels[0].n, [level.rows for level in levels])
        for _ in range(3):
            solution = solver.solve(levels)
            for array in (solution.x, *solution.w, *solution.v, *solution.active):
                digest.update(array.tobytes())
            for level in levels:
                level.b[:] += 0.01
print(digest.hexdigest())
"""


def test_the_same_problems_give_the_same_bits_in_every_process():
    digests = {
        subprocess.run(
            [sys.executable, "-c", ANSWERS, size], check=True, capture_output=True, text=True
        ).stdout
        for size in ("1", "1001", "54321")
    }
    assert len(digests) == 1
