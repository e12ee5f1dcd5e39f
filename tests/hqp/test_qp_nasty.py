"""Random quadratic programs of nasty kinds, judged by their optimality conditions and by quadprog."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest
from hapticd.hqp import HqpError, Status, UnboundedError, qp, solve_qp
from hapticd.hqp.certificate_qp import contradiction, faults, parts_of, ray_faults
from hapticd.hqp.generate_qp import KINDS, curve_qp, fit_qp, infeasible_qp, qp_of, unbounded_qp

FIRST, PROBLEMS = 20_000, 150
"""Of the seeds: those below were tuned on."""
WORST = 1e-8
FULL = 20001
"""A seed of "plain" with constraints of each kind."""

FALSE_RAYS = 4944, 10159
"""Fits of which rounding alone seemed to have a ray."""


@pytest.fixture
def alone(monkeypatch):
    """Without the attempt in other units behind it."""

    def refuse(*_):
        raise AssertionError("the dual method gave up")

    monkeypatch.setattr(qp, "solve_scaled", refuse)


@pytest.mark.parametrize("kind", KINDS)
def test_nasty_qps_are_optimal_by_their_multipliers(kind, alone):
    for seed in range(FIRST, FIRST + PROBLEMS):
        problem = qp_of(kind, seed)
        found = solve_qp(**problem)
        assert found.found and found.status is Status.SOLVED, seed
        worst = faults(problem, found)
        assert max(worst.values()) < WORST and worst["sign"] == 0.0, (seed, worst)


@pytest.mark.parametrize(("drawn", "most"), [(fit_qp, 0), (curve_qp, 1)])
def test_what_data_leave_free_is_no_way_down_for_ever_and_is_proven_all_but_always(drawn, most):
    unproven = []
    for seed in [*FALSE_RAYS, *range(FIRST, FIRST + 600)]:
        problem = drawn(seed)
        found = solve_qp(**problem)
        if not found.found:
            unproven.append(seed)
            continue
        worst = faults(problem, found)
        assert max(worst.values()) < WORST and worst["sign"] == 0.0, (seed, worst)
    assert len(unproven) <= most, unproven


@pytest.mark.parametrize("kind", ["plain", "degenerate", "boxed", "equal"])
def test_a_strictly_convex_qp_has_the_answer_of_quadprog(kind):
    quadprog, compared = pytest.importorskip("quadprog"), 0
    for seed in range(FIRST, FIRST + PROBLEMS // 3):
        problem = qp_of(kind, seed)
        P, q, G, h, A, b, lb, ub = parts_of(problem)
        box = np.eye(len(q))
        rows, least = np.vstack([A, -G, box, -box]), np.concatenate([b, -h, lb, -ub])
        acts = np.isfinite(least)
        if not acts.any():
            continue
        try:
            x = quadprog.solve_qp(P, -q, rows[acts].T.copy(), least[acts], len(b))[0]
        except ValueError:
            continue
        compared += 1
        ours = solve_qp(**problem)
        value = 0.5 * x @ P @ x + q @ x
        assert abs(ours.objective - value) < 1e-6 * (1.0 + abs(value)), seed
    assert compared > PROBLEMS // 6


@pytest.mark.parametrize("kind", ["plain", "singular", "degenerate"])
def test_a_start_leads_to_the_same_objective(kind, alone):
    for seed in range(FIRST, FIRST + PROBLEMS):
        problem = qp_of(kind, seed)
        cold = solve_qp(**problem)
        starts = [cold.x, cold.x + np.random.default_rng(seed).normal(size=len(cold.x))]
        warm = [solve_qp(**problem, initvals=start) for start in starts]
        for found in warm:
            assert max(faults(problem, found).values()) < WORST, seed
            assert found.objective == pytest.approx(cold.objective, rel=1e-8, abs=1e-8)


def test_the_same_data_give_the_same_bits_whatever_was_solved_before():
    problems = [qp_of(kind, seed) for kind in KINDS for seed in range(10)]
    first = [solve_qp(**problem) for problem in problems]
    for problem, before in zip(reversed(problems), reversed(first), strict=True):
        again = solve_qp(**problem)
        for name in ("x", "y", "z", "z_box"):
            assert getattr(again, name).tobytes() == getattr(before, name).tobytes()


def test_contradicting_rows_are_named_with_weights_that_prove_it(alone):
    for seed in range(FIRST, FIRST + PROBLEMS):
        problem = infeasible_qp(seed)
        found = solve_qp(**problem)
        assert not found.found and found.status is Status.SOLVED, seed
        left, bound = contradiction(problem, found.conflict)
        assert left < 1e-9 and bound < -1e-6, seed


def test_an_objective_without_minimum_is_refused_with_a_ray(alone):
    for seed in range(FIRST, FIRST + PROBLEMS):
        problem = unbounded_qp(seed)
        with pytest.raises(UnboundedError) as caught:
            solve_qp(**problem)
        worst = ray_faults(problem, caught.value.ray)
        assert worst.pop("slope") < 0.0 and max(worst.values()) < 1e-7, seed


def test_a_step_that_ends_in_a_vertex_is_no_ray(alone):
    problem = qp_of("linear", 944)
    assert max(faults(problem, solve_qp(**problem)).values()) < WORST


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_not_proven_is_solved_in_other_units(kind, monkeypatch):
    monkeypatch.setattr(qp, "_solve", lambda *_: SimpleNamespace(found=False, _ends=qp.NOT_PROVEN))
    for seed in range(20):
        problem = qp_of(kind, seed)
        assert max(faults(problem, solve_qp(**problem)).values()) < WORST, seed
    for seed in range(20):
        assert solve_qp(**infeasible_qp(seed)).conflict
        with pytest.raises(UnboundedError):
            solve_qp(**unbounded_qp(seed))


@pytest.mark.parametrize(
    ("constraints", "x"),
    [
        ({}, 2.0),
        ({"ub": [1.0]}, 1.0),
        ({"lb": [3.0], "ub": [np.inf]}, 3.0),
        ({"lb": [0.5], "ub": [0.5]}, 0.5),
        ({"G": np.empty((0, 1)), "h": np.empty(0), "A": [[2.0]], "b": [2.0]}, 1.0),
        ({"G": [[1.0], [0.0]], "h": [np.inf, 0.0]}, 2.0),
        ({"A": [[0.0]], "b": [0.0]}, 2.0),
    ],
)
def test_one_variable(constraints, x, alone):
    assert solve_qp([[1.0]], [-2.0], **constraints).x == pytest.approx([x], abs=1e-12)


def test_variables_at_their_bound_are_there_to_the_last_bit(alone):
    for seed in range(FIRST, FIRST + 50):
        problem = qp_of("boxed", seed)
        found = solve_qp(**problem)
        bound = np.where(found.z_box > 0.0, problem["ub"], problem["lb"])
        held = found.z_box != 0.0
        assert (found.x == bound)[held].all(), seed


def test_an_objective_that_is_least_where_all_its_parts_are_zero(alone):
    found = solve_qp([[2.0, -2.0], [-2.0, 2.0]], [0.0, 0.0], A=[[1.0, 1.0]], b=[1.0], lb=[0.0, 0.0])
    assert found.found and found.x == pytest.approx([0.5, 0.5], abs=1e-12)


def test_large_multipliers_that_nearly_cancel_are_proven(alone):
    rng = np.random.default_rng(7)
    A = np.vstack([rng.normal(size=(4, 8)), np.zeros((4, 8))])
    A[4:] = A[:4] + 1e-6 * rng.normal(size=(4, 8))
    x = rng.normal(size=8)
    found = solve_qp(np.eye(8), 1e3 * rng.normal(size=8), A=A, b=A @ x)
    assert np.abs(found.y).max() > 1e6 and found.found
    np.testing.assert_allclose(found.x, x, atol=1e-6)


@pytest.mark.parametrize("constraints", [{"lb": [1.0], "ub": [0.0]}, {"A": [[0.0]], "b": [1.0]}])
def test_bounds_that_nothing_meets_are_not_found(constraints):
    assert not solve_qp([[1.0]], [-2.0], **constraints).found


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"initvals": [np.nan, 0.0]}, "NaN"),
        ({"lb": [np.nan, 0.0]}, "NaN"),
        ({"P": [[1.0, 0.0], [0.0, -1e-6]]}, "not positive semidefinite"),
    ],
)
def test_what_cannot_be_meant_is_an_error(change, says):
    with pytest.raises(HqpError, match=says):
        solve_qp(**{"P": np.eye(2), "q": [1.0, 1.0], **change})


def test_arrays_of_any_memory_order_and_type_are_read():
    P, q, G, h = (
        np.array([[2, 1], [1, 2]]),
        np.array([-3, -3]),
        np.array([[1.0, 0.0], [2.0, 9.0]]),
        [0.5, 99.0],
    )
    plain = solve_qp(P.astype(float), q.astype(float), G, np.array(h))
    for found in (
        solve_qp(P, q, np.asfortranarray(G), h),
        solve_qp(P.tolist(), q[::-1], G[:, ::1], tuple(h)),
    ):
        assert found.x.tobytes() == plain.x.tobytes()


def unaligned(array):
    """The same numbers, one byte off."""
    memory = np.zeros(array.nbytes + 1, dtype=np.uint8)[1:]
    moved = np.ndarray(array.shape, array.dtype, memory)
    moved[...] = array
    return moved


class Labelled(np.ndarray):
    """A subclass, as some libraries have them."""


def frozen(array):
    """The same numbers, not to be written to."""
    copy = array.copy()
    copy.flags.writeable = False
    return copy


@pytest.mark.parametrize(
    "change",
    [
        unaligned,
        frozen,
        lambda array: array.astype(">f8"),
        lambda array: np.repeat(array, 2, axis=-1)[..., ::2],
        lambda array: array.view(Labelled),
    ],
)
def test_arrays_of_any_layout_are_read(change):
    problem = qp_of("plain", FULL)
    plain, found = solve_qp(**problem), solve_qp(**{name: change(part) for name, part in problem.items()})
    assert found.x.tobytes() == plain.x.tobytes() and found.y.tobytes() == plain.y.tobytes()


@pytest.mark.parametrize("name", ["P", "q", "G", "h", "A", "b", "lb", "ub", "initvals"])
@pytest.mark.parametrize(
    "change",
    [
        lambda array: array[:-1],
        lambda array: array[..., None],
        lambda array: array[None],
        lambda array: np.concatenate([array, array]),
        lambda array: np.asarray(1.0),
        lambda array: array[:0],
        lambda array: "text",
        lambda array: [[1.0], [1.0, 2.0]],
    ],
)
def test_an_argument_of_another_shape_is_an_error(name, change):
    problem = qp_of("plain", FULL)
    problem["initvals"] = np.zeros(len(problem["q"]))
    with pytest.raises(HqpError):
        solve_qp(**{**problem, name: change(problem[name])})


@pytest.mark.parametrize("missing", ["G", "h", "A", "b"])
def test_rows_without_bounds_and_bounds_without_rows_are_an_error(missing):
    with pytest.raises(HqpError):
        solve_qp(**{**qp_of("plain", FULL), missing: None})


def test_threads_do_not_share_memory():
    problems = [qp_of(KINDS[k % len(KINDS)], k) for k in range(200)]
    alone = [solve_qp(**problem).x.tobytes() for problem in problems]
    with ThreadPoolExecutor(12) as pool:
        for _ in range(5):
            beside = pool.map(lambda problem: solve_qp(**problem).x.tobytes(), problems)
            assert list(beside) == alone


def test_a_solution_is_the_same_from_another_process():
    found = solve_qp(**qp_of("plain", FULL))
    again = pickle.loads(pickle.dumps(found))
    assert repr(again) == repr(found) and again.status is Status.SOLVED
    for name in ("x", "y", "z", "z_box"):
        assert getattr(again, name).tobytes() == getattr(found, name).tobytes()
