"""Quadratic programs by qpsolvers' names."""

import numpy as np
import pytest
from hapticd.hqp import HqpError, Status, UnboundedError, solve_qp
from hapticd.hqp.reference import QpError, quadprog_qp

INF = np.inf


def random_qp(seed, rank=None):
    """A feasible convex QP with every kind of constraint; P of this rank and a q outside its range."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 20))
    rows = rng.normal(size=(n if rank is None else max(1, int(rank * n)), n))
    point = rng.normal(size=n)
    G, A = (
        rng.normal(size=(int(rng.integers(1, 2 * n)), n)),
        rng.normal(size=(int(rng.integers(n // 2 + 1)), n)),
    )
    h = G @ point + np.where(rng.random(len(G)) < 0.3, 0.0, rng.exponential(size=len(G)))
    lb, ub = point - rng.exponential(2.0, size=n), point + rng.exponential(2.0, size=n)
    loose = rng.random(n) < 0.3 if rank is None else np.zeros(n, dtype=bool)
    lb[loose], ub[loose] = -INF, INF
    objective = {"P": rows.T @ rows, "q": 3.0 * rng.normal(size=n)}
    return {**objective, "G": G, "h": h, "A": A, "b": A @ point, "lb": lb, "ub": ub}


def assert_optimal(qp, found, tolerance=1e-7):
    """The conditions of Karush, Kuhn and Tucker, from the data, x and the multipliers alone."""
    assert found.found and found.status is Status.SOLVED
    x, size = found.x, 1.0 + np.abs(qp["q"]).max()
    gradient = qp["P"] @ x + qp["q"] + qp["A"].T @ found.y + qp["G"].T @ found.z + found.z_box
    assert np.abs(gradient).max() < tolerance * size
    assert (qp["G"] @ x <= qp["h"] + tolerance).all() and np.abs(qp["A"] @ x - qp["b"]).max(
        initial=0
    ) < tolerance
    assert (x >= qp["lb"] - tolerance).all() and (x <= qp["ub"] + tolerance).all()
    assert (found.z >= -tolerance).all() and np.abs(
        found.z * (qp["G"] @ x - qp["h"])
    ).max() < tolerance * size
    bound = np.where(found.z_box > 0.0, qp["ub"], qp["lb"])
    held = found.z_box != 0.0
    assert np.abs(found.z_box[held] * (x - bound)[held]).max(initial=0.0) < tolerance * size


@pytest.mark.parametrize("seed", range(40))
def test_a_strictly_convex_qp_is_optimal_by_its_multipliers_and_as_quadprog_has_it(seed):
    qp = random_qp(seed)
    found = solve_qp(**qp)
    assert_optimal(qp, found)
    box = np.eye(len(found.x))
    rows = np.vstack([-qp["G"], qp["A"], -qp["A"], box, -box])
    least = np.concatenate([-qp["h"], qp["b"], -qp["b"], qp["lb"], -qp["ub"]])
    acts = np.isfinite(least)
    try:
        x, _ = quadprog_qp(qp["P"], -qp["q"], rows[acts], least[acts])
    except QpError:
        return
    np.testing.assert_allclose(found.x, x, atol=1e-6)


@pytest.mark.parametrize("rank", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("seed", range(15))
def test_a_singular_p_with_q_outside_its_range_is_solved_by_proximal_steps(seed, rank):
    qp = random_qp(seed, rank)
    if rank == 0.0:
        qp["P"] = np.zeros_like(qp["P"])
    assert_optimal(qp, solve_qp(**qp))


def test_a_singular_p_with_q_in_its_range_needs_no_proximal_step():
    found = solve_qp([[2.0, 2.0], [2.0, 2.0]], [-4.0, -4.0])
    assert found.found and found.iterations == 0
    np.testing.assert_allclose(found.x, [1.0, 1.0], atol=1e-12)
    assert found.objective == pytest.approx(-4.0)


@pytest.mark.parametrize("constraints", [{}, {"G": [[1.0, 0.0]], "h": [1.0]}, {"lb": [0.0, 0.0]}])
def test_an_objective_without_minimum_is_refused_with_the_ray_along_which_it_falls(constraints):
    with pytest.raises(UnboundedError) as caught:
        solve_qp([[1.0, 0.0], [0.0, 0.0]], [1.0, -2.0], **constraints)
    np.testing.assert_allclose(caught.value.ray, [0.0, 1.0], atol=1e-6)


def test_contradicting_constraints_are_named_the_worst_first():
    G, h = [[1.0, 1.0], [0.0, 1.0]], [-3.0, 50.0]
    found = solve_qp(np.eye(2), [0.0, 0.0], G, h, A=[[1.0, -1.0]], b=[0.0], lb=[0.0, -9.0])
    assert not found.found and found.status is Status.SOLVED
    assert {(part, row) for part, row, _ in found.conflict} == {("G", 0), ("A", 0), ("box", 0)}
    sizes = [abs(multiplier) for *_, multiplier in found.conflict]
    assert sizes == sorted(sizes, reverse=True)
    with pytest.raises(HqpError, match="not solved"):
        found.z  # noqa: B018


def test_a_conflict_is_found_whatever_the_objective_makes_of_it():
    P = [[0, 0, 0], [0, 3, 3], [0, 3, 3]]
    G, h = [[0, 2, 2], [0, 2, -2], [2, -2, 2], [-1, 0, -2]], [0, 7, -4, 1]
    found = solve_qp(P, [-3, 2, 1], G, h)  # half of rows 0 and 2, and row 3: 0 x <= -1
    assert [(name, row) for name, row, _ in found.conflict] == [("G", 3), ("G", 0), ("G", 2)]


def test_a_support_vector_machine_of_one_feature_takes_many_steps_and_is_solved():
    for seed in range(12):
        rng = np.random.default_rng(seed)
        label = np.where(rng.random(80) < 0.5, 1.0, -1.0)
        feature = rng.normal(size=80) * label
        lb, ub = np.zeros(80), np.full(80, 0.1)
        found = solve_qp(np.outer(feature, feature), -np.ones(80), A=label[None], b=[0.0], lb=lb, ub=ub)
        assert found.status is Status.SOLVED


def test_a_start_at_the_solution_leaves_nothing_to_do():
    qp = random_qp(4)
    cold = solve_qp(**qp)
    warm = solve_qp(**qp, initvals=cold.x)
    np.testing.assert_allclose(warm.x, cold.x, atol=1e-9)
    assert cold.iterations > 2 and warm.iterations < cold.iterations


def test_limits_end_the_solve_with_a_status():
    qp = random_qp(4)
    assert solve_qp(**qp, max_iterations=1).status is Status.ITERATION_CAP
    late = solve_qp(**qp, time_limit=1e-9)
    assert late.status is Status.TIME_LIMIT and not late.found


def test_limits_end_the_search_for_the_x_that_breaks_contradicting_constraints_least():
    """The contradiction is found with the first rows; that x needs many working sets."""
    rng = np.random.default_rng(1)
    n, m = 40, 300
    G, h = rng.normal(size=(m, n)), 0.1 * np.abs(rng.normal(size=m))
    h[10:30], G[30:50], h[30:50] = -1e3, -G[10:30], 0.0
    whole = solve_qp(np.eye(n), np.zeros(n), G, h)
    assert whole.status is Status.SOLVED and not whole.found and whole.conflict
    cut = solve_qp(np.eye(n), np.zeros(n), G, h, max_iterations=whole.iterations + 1)
    assert cut.status is Status.ITERATION_CAP and not cut.found and cut.conflict


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"P": [[1.0, 2.0], [0.0, 1.0]]}, "not symmetric"),
        ({"P": [[1.0, 0.0], [0.0, -1.0]]}, "not positive semidefinite"),
        ({"P": np.eye(3)}, "shape"),
        ({"q": [[1.0]]}, "dimension"),
        ({"q": [1.0, np.nan]}, "NaN"),
        ({"P": "text"}, "not an array of real numbers"),
        ({"q": None}, "q is missing"),
        ({"G": [[1.0, 0.0]]}, "one without the other"),
        ({"G": [[1.0]], "h": [1.0]}, "columns"),
        ({"lb": [0.0]}, "shape"),
        ({"initvals": [0.0]}, "shape"),
    ],
)
def test_what_cannot_be_meant_is_an_error(change, says):
    with pytest.raises(HqpError, match=says):
        solve_qp(**{"P": np.eye(2), "q": [1.0, 1.0], **change})
