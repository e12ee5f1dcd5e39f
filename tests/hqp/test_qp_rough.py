"""Whatever solve_qp says of the roughest quadratic programs, from their data alone."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from hapticd.hqp import HqpError, Status, UnboundedError, qp_scaled, solve_qp
from hapticd.hqp import qp as qp_module
from hapticd.hqp.certificate_qp import contradiction, faults, ray_faults
from hapticd.hqp.generate_qp import qp_of, rough_qp

INF = np.inf
FIRST, PROBLEMS = 2_000_000, 3000
"""Of the seeds: those below were tuned on."""
WORST = 1e-6
MOST_UNPROVEN = 0.005
"""Of the problems."""


@pytest.mark.filterwarnings("error")
def test_what_is_said_of_rough_qps_is_proven_by_their_data():
    unproven = 0
    for seed in range(FIRST, FIRST + PROBLEMS):
        qp, is_feasible = rough_qp(seed)
        try:
            found = solve_qp(**qp)
        except UnboundedError as error:
            worst = ray_faults(qp, error.ray)
            assert worst.pop("slope") < 0.0 and worst.pop("P") < 1e-9 and max(worst.values()) < 1e-7, seed
            continue
        if found.found:
            worst = faults(qp, found)
            assert found.status is Status.SOLVED and max(worst.values()) < WORST, (seed, worst)
        elif found.conflict:
            assert not is_feasible, seed
            left, bound = contradiction(qp, found.conflict)
            assert left < 1e-7 and bound < 0.0, seed
        else:
            assert found.status is Status.NOT_PROVEN, (seed, found)
            unproven += 1
    assert unproven < MOST_UNPROVEN * PROBLEMS


@pytest.mark.parametrize("factor", [1e-9, 1e9])
def test_the_size_of_the_objective_does_not_matter(factor):
    for kind in ("singular", "near", "linear", "scaled"):
        for seed in range(100):
            qp = qp_of(kind, seed)
            found = solve_qp(**{**qp, "P": factor * qp["P"], "q": factor * qp["q"]})
            assert found.found and max(faults(qp, _unscaled(found, factor)).values()) < WORST


def _unscaled(found, factor):
    found._multipliers = found._multipliers / factor
    return found


def test_a_conflict_found_in_other_units_is_one_in_the_callers():
    """Units of P 1e4 apart: of a sum of rows that does not cancel nothing was left in them."""
    P = np.array(
        [
            [1.9997570706794431e-07, -1.1412962987457757e-01, -1.4554022155496977e-07],
            [-1.1412962987457757e-01, 1.2614304847521821e08, 1.1048399482965747e00],
            [-1.4554022155496977e-07, 1.1048399482965747e00, 1.1420347396348516e-07],
        ]
    )
    G = [[-1, 2, -1], [0, -2, -2], [-1, -2, 2], [1, -1, -1], [-1, 1, 0], [-1, -1, -1], [0, 2, 2]]
    h = [0.800001, -5.0, -4.8, -0.2, -0.3, -4.8, 5.0]
    qp = {"P": P, "q": np.array([-2.0, 0.0, 2.0]), "G": np.array(G, dtype=float), "h": np.array(h)}
    qp |= {"lb": np.full(3, -5.0), "ub": np.full(3, 5.0)}
    found = solve_qp(**qp)
    left, bound = contradiction(qp, found.conflict)
    assert not found.found and left < 1e-9 and bound < -1e-3


def test_a_row_that_alone_cannot_be_met_is_the_conflict():
    P, q = np.eye(2), np.zeros(2)
    of_zeros = solve_qp(P, q, G=[[1.0, 0.0], [0.0, 0.0]], h=[1.0, -1.5e-7])
    assert not of_zeros.found and of_zeros.conflict == [("G", 1, 1.0)]
    equality = solve_qp(P, q, A=[[0.0, 0.0]], b=[2.0])
    assert equality.conflict in ([("A", 0, 1.0)], [("A", 0, -1.0)])
    assert equality.conflict[0][2] * 2.0 < 0.0
    crossed = solve_qp(P, q, lb=[0.0, 3.0], ub=[1.0, 2.0])
    assert crossed.conflict == [("box", 1, 1.0), ("box", 1, -1.0)]
    np.testing.assert_allclose(crossed.x, [0.0, 2.5], atol=1e-9)


def test_bounds_that_cross_by_rounding_are_one():
    found = solve_qp([[1.0]], [0.0], lb=[0.1 + 0.2], ub=[0.3])
    assert found.found and found.x == pytest.approx(0.3)


def test_without_an_objective_any_x_that_meets_the_constraints_is_the_answer():
    found = solve_qp(np.zeros((2, 2)), np.zeros(2), A=[[1.0, 2.0]], b=[3.0], lb=np.zeros(2))
    assert found.found and not found.y.any() and not found.z_box.any()
    assert found.x @ [1.0, 2.0] == pytest.approx(3.0)


def test_an_answer_in_other_units_counts_only_if_it_is_proven_in_the_callers(monkeypatch):
    attempts = []

    def counted(*arguments):
        attempts.append(seed)
        return qp_scaled.solve_scaled(*arguments)

    monkeypatch.setattr(qp_module, "solve_scaled", counted)
    solved = []
    for seed in range(2000):
        if is_found(seed) and seed in attempts:
            solved.append(seed)
    assert len(solved) > 2
    monkeypatch.setattr(qp_scaled, "is_proven", lambda *_: False)
    for seed in solved:
        found = solve_qp(**rough_qp(seed)[0])
        assert not found.found and found.status is Status.NOT_PROVEN
        with pytest.raises(HqpError, match="not solved"):
            found.y  # noqa: B018


def is_found(seed):
    try:
        return solve_qp(**rough_qp(seed)[0]).found
    except UnboundedError:
        return False


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"q": [1.0 + 2.0j, 0.0]}, "q is not an array of real numbers"),
        ({"q": ["1.0", "2.0"]}, "q is not an array of real numbers"),
        ({"q": [b"1", b"2"]}, "q is not an array of real numbers"),
        ({"q": np.array(["2026-01-01", "2026-01-02"], dtype="M8[D]")}, "q is not an array of real numbers"),
        ({"q": np.ma.masked_array([1.0, 2.0], [True, False])}, "q is a masked array"),
        ({"P": np.full((2, 2), INF)}, "P has an entry that is infinite"),
        ({"lb": [INF, 0.0]}, "lb has an entry that is inf: no x meets it"),
        ({"G": [[1.0, 0.0]], "h": [-INF]}, "h has an entry that is -inf"),
        ({"A": [[1.0, 0.0]], "b": [INF]}, "b has an entry that is infinite"),
        ({"initvals": [0.0, np.nan]}, "initvals has an entry that is NaN"),
        ({"max_iterations": -1}, "max_iterations is -1"),
        ({"max_iterations": 1.5}, "max_iterations is 1.5"),
        ({"time_limit": -1.0}, "time_limit is -1.0"),
        ({"time_limit": np.nan}, "time_limit is nan"),
        ({"time_limit": 10**400}, "time_limit is no number of seconds"),
        ({"P": np.empty((0, 0)), "q": []}, "q has 0 entries"),
        ({"P": np.eye(1025), "q": np.zeros(1025)}, "q has 1025 entries"),
        ({"G": np.ones((8193, 2)), "h": np.ones(8193)}, "have 8193 rows"),
    ],
)
def test_data_that_solve_qp_does_not_take_are_named(change, says):
    with pytest.raises(HqpError, match=says):
        solve_qp(**{"P": np.eye(2), "q": np.ones(2), **change})


def test_whole_numbers_and_lists_are_numbers():
    for q in ([1, 2], np.array([1, 2]), np.array([1, 2], dtype=object), np.array([1, 2], dtype=np.float16)):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            np.testing.assert_allclose(solve_qp(np.eye(2, dtype=int), q).x, [-1.0, -2.0])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("seed", [1825, 2496, 5472])
def test_what_is_too_large_in_the_units_of_the_caller_is_right_or_not_proven(seed):
    """Units of 1e-40 to 1e40: an x of 1e200 and more was found, whose objective is no number."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    B = rng.normal(size=(n, int(rng.integers(1, n + 1))))
    unit = 10.0 ** rng.uniform(-6, 6, size=n)
    if rng.random() < 0.5:
        unit = 10.0 ** rng.uniform(-40, 40, size=n)
    P = unit[:, None] * (B @ B.T) * unit
    P = 0.5 * (P + P.T)
    if rng.random() < 0.7:
        q = P @ rng.normal(size=n) * 10.0 ** rng.uniform(0, 30)
    else:
        q = rng.normal(size=n) * 10.0 ** rng.uniform(-20, 40)
    G = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-30, 30, size=(n, 1))
    qp = {"P": P, "q": q, "G": G, "h": rng.normal(size=n) * 10.0 ** rng.uniform(-30, 30)}
    found = solve_qp(**qp)
    if found.found:
        assert np.isfinite(found.objective) and max(faults(qp, found).values()) < WORST
    else:  # which of the two it is the last digits of P decide, and those the machine
        assert found.status in (Status.NOT_PROVEN, Status.ITERATION_CAP)
    assert np.isfinite(found.x).all() and np.isfinite(found.objective)


@pytest.mark.parametrize("unit", [1e9, 1e10, 1e12])
def test_a_ray_that_leaves_a_bound_in_other_units_is_none(unit):
    """x + unit y <= 1 and y >= -1 end x; along (1, -1 / unit) y moves by less than a row is looked at."""
    rows = {"G": np.array([[1.0, unit], [0.0, -1.0]]), "h": np.ones(2)}
    bounds = {"G": rows["G"][:1], "h": np.ones(1), "lb": np.array([-INF, -1.0])}
    for constraints in (rows, bounds):
        found = solve_qp(np.zeros((2, 2)), np.array([-1.0, 0.0]), **constraints)
        assert found.found and found.x == pytest.approx([1.0 + unit, -1.0])


@pytest.mark.parametrize("size", [1.0, 1e2, 1e3, 1e5])
def test_rows_contradict_each_other_whatever_the_objective(size):
    """The objective falls for ever along (1, -1), and no point meets both rows."""
    found = solve_qp(
        np.ones((2, 2)),
        size * np.array([-3.0, 1.0]),
        np.array([[-1.0, -1.0], [1.0, 1.0]]),
        np.array([3.0, -3.25]),
    )
    assert sorted(found.conflict) == [("G", 0, 1.0), ("G", 1, 1.0)]


def test_a_limit_that_ends_the_search_for_the_begin_of_a_ray_is_named():
    """x falls for ever where y and z are at least 1: a guess holds both rows, the search needs two steps."""
    data = (
        np.zeros((3, 3)),
        np.array([-1.0, 0.0, 0.0]),
        np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
        -np.ones(2),
    )
    with pytest.raises(UnboundedError):
        solve_qp(*data)
    found = solve_qp(*data, initvals=np.ones(3), max_iterations=1)
    assert found.status is Status.ITERATION_CAP and not found.found


def test_small_integers_that_contradict_each_other_are_called_so():
    for seed in range(1000):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(2, 4))
        root, row = rng.integers(-1, 2, (n, n)), rng.integers(-2, 3, n)
        row[0] = row[0] or 1
        G, h = (
            np.array([row, -row], dtype=float),
            np.array([0.0, -1.0]) + rng.integers(-2, 3) * np.array([1, -1]),
        )
        found = solve_qp(root.T @ root * 1.0, 1000.0 * rng.integers(-3, 4, n), G, h)
        assert sorted(row[:2] for row in found.conflict) == [("G", 0), ("G", 1)], seed


def test_rows_that_are_met_within_the_radius_are_no_conflict():
    """Feasible by its making, in units of 1e-6 to 1e6 (a stranger's): |x| is 1e5."""
    for seed in range(21_000, 23_000):
        data, x = bounded_lp(seed)
        try:
            found = solve_qp(*data)
        except UnboundedError:
            pytest.fail(f"{seed} is bounded")
        inside = np.linalg.norm(x) <= 1e4 * (1.0 + np.linalg.norm(found.x))
        assert not (found.conflict and inside), seed


def bounded_lp(seed):
    """P, q, G, h, A, b of a linear program with a minimum, variables in units of their own; a feasible x."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    G, A = (rng.normal(size=(int(k), n)) for k in (rng.integers(1, 3 * n + 1), rng.integers(0, n)))
    G, A = (rows * (rng.random(rows.shape) < 0.7) for rows in (G, A))
    reach = rng.uniform(4.0, 6.0)
    unit = 10.0 ** rng.uniform(-reach, reach, size=n)
    q = -(G.T @ rng.exponential(size=len(G))) * unit
    G, A, x = G * unit, A * unit, rng.normal(size=n) / unit
    return (np.zeros((n, n)), q, G, G @ x + 10.0 ** rng.uniform(-3, 0, size=len(G)), A, A @ x), x


@pytest.mark.parametrize("P", [[1.0, -5e-10], [1e10, -8.0], [1e8, -0.01], [-1e-300, 0.0]])
def test_a_negative_diagonal_entry_is_not_convex(P):
    with pytest.raises(HqpError, match="not positive semidefinite"):
        solve_qp(np.diag(P), np.zeros(2), lb=-np.ones(2), ub=np.ones(2))
    assert solve_qp(np.diag([1.0, -1e-17]), np.zeros(2), lb=-np.ones(2), ub=np.ones(2)).found


@pytest.mark.parametrize("part", ["G", "A"])
def test_the_most_rows_that_contradict_each_other_have_a_conflict(part):
    rows = np.vstack([np.ones((8191, 2)), -np.ones((1, 2))])
    bounds = np.concatenate([np.zeros(8191), [-1.0]])
    data = {"G": {"G": rows, "h": bounds}, "A": {"A": rows, "b": bounds}}[part]
    found = solve_qp(np.eye(2), np.ones(2), lb=-np.ones(2), ub=np.ones(2), **data)
    assert [(name, row) for name, row, _ in found.conflict] == [(part, 0), (part, 8191)]


def test_an_x_so_long_that_its_rounding_hides_a_contradiction_is_not_proven():
    """24 variables with units over 3 orders, and rows that contradict each other by .01: at |x| = 1e50 each
    is missed by no more than the rounding of its terms."""
    with np.load(Path(__file__).with_name("data") / "qp_contradiction.npz") as file:
        found = solve_qp(**file)
    assert not found.found and (found.conflict or found.status is Status.NOT_PROVEN)


@pytest.mark.parametrize("far", [1e3, 1e9, 1e12])
def test_a_long_x_that_meets_its_rows_is_proven(far):
    G = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [-1.0, 0.0, 0.0]])
    found = solve_qp(np.eye(3), np.zeros(3), G=G, h=np.array([0.0, 0.0, -far]))
    assert found.status is Status.SOLVED
    np.testing.assert_allclose(found.x, far, rtol=1e-12)
