import numpy as np
import pytest
from hapticd.hqp import Level, Slacks, Solver, Status
from hapticd.hqp.certificate import slack_norms
from hapticd.hqp.generate import KINDS, problem


@pytest.mark.parametrize("kind", KINDS)
def test_every_level_has_the_slack_that_its_own_rows_leave(kind):
    levels = problem(kind, 3)
    solver = Solver(levels[0].n, [level.rows for level in levels])
    slacks, found = Slacks(solver.solution, len(levels), range(len(levels))), np.zeros(len(levels))
    solution = solver.solve(levels)
    slacks.write(found)
    assert np.allclose(found, slack_norms(levels, solution.x), rtol=1e-9, atol=1e-9)


def test_a_level_stands_in_its_place_or_nowhere_and_refused_data_have_none():
    levels = [Level(A=np.eye(1), b=np.array([b])) for b in (1.0, 3.0, 8.0)]
    solver = Solver(1, [level.rows for level in levels])
    slacks, found = Slacks(solver.solution, 2, [1, None, 0]), np.zeros(2)
    solver.solve(levels)
    slacks.write(found)
    assert found == pytest.approx([7.0, 0.0], abs=1e-12)
    levels[2].b[:] = np.nan
    assert solver.solve(levels).status is Status.BAD_MATRIX
    slacks.write(found)
    assert np.isnan(found).all()
