"""The adapter of docs/examples for qpsolvers."""

import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).parent.parent.parent / "docs" / "examples"
qpsolvers = pytest.importorskip("qpsolvers")


@pytest.fixture(autouse=True)
def adapter(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import hapticd_

    assert "hapticd" in qpsolvers.available_solvers
    return hapticd_


def test_a_problem_of_qpsolvers_is_solved_with_all_its_multipliers():
    rng = np.random.default_rng(5)
    M, G, A = rng.normal(size=(6, 6)), rng.normal(size=(4, 6)), rng.normal(size=(2, 6))
    problem = qpsolvers.Problem(
        M.T @ M, rng.normal(size=6), G, np.ones(4), A, np.ones(2), np.full(6, -0.5), np.full(6, 2.0)
    )
    solution = qpsolvers.solve_problem(problem, solver="hapticd")
    assert solution.found and solution.is_optimal(1e-8)
    x = qpsolvers.solve_qp(*problem.unpack(), solver="hapticd", initvals=solution.x)
    np.testing.assert_allclose(x, solution.x, atol=1e-9)


def test_without_box_there_are_no_multipliers_of_it():
    problem = qpsolvers.Problem(np.eye(2), -np.ones(2), np.ones((1, 2)), np.ones(1))
    solution = qpsolvers.solve_problem(problem, solver="hapticd")
    assert solution.is_optimal(1e-9) and solution.z_box.size == 0


def test_what_has_no_solution_is_not_found_and_says_why():
    infeasible = qpsolvers.Problem(np.eye(1), np.ones(1), lb=np.ones(1), ub=np.zeros(1))
    unbounded = qpsolvers.Problem(np.zeros((1, 1)), np.ones(1))
    with pytest.raises(qpsolvers.ProblemError):
        qpsolvers.solve_problem(qpsolvers.Problem(-np.eye(1), np.ones(1)), solver="hapticd")
    solution = qpsolvers.solve_problem(unbounded, solver="hapticd")
    assert not solution.found and solution.extras["ray"] == [-1.0]
    assert not qpsolvers.solve_problem(infeasible, solver="hapticd").found
    rows = qpsolvers.Problem(np.eye(1), np.ones(1), np.array([[1.0], [-1.0]]), np.array([-1.0, -1.0]))
    solution = qpsolvers.solve_problem(rows, solver="hapticd")
    assert not solution.found and {row for _, row, _ in solution.extras["conflict"]} == {0, 1}


def test_the_module_is_the_one_of_the_examples(adapter):
    assert Path(adapter.__file__).parent == EXAMPLES and "hapticd_" in sys.modules
