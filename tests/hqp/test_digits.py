import numpy as np
import pytest
from hapticd.hqp import Level, Status, solve
from hapticd.hqp.certificate import slack_norms
from hapticd.hqp.generate import KINDS, problem

from .digits import optimum

# rows that are dependent but for rounding, of which 90 digits make much
DECIDED_BY_ROUNDING = {"rank_deficient", "faint_direction", "tall", "mixed"}


@pytest.mark.parametrize("pull", [1e-15, 1e-11, 1e-3])
def test_with_90_digits_a_row_is_held_however_small_its_multiplier_is(pull):
    """x <= 0, y = 0, then pull x + y = 1, which x = 0 is best for, whatever x = -5 would like."""
    none = np.array([-np.inf])
    levels = [
        Level(C=np.array([[1.0, 0.0]]), lb=none, ub=np.zeros(1)),
        Level(A=np.array([[0.0, 1.0]]), b=np.zeros(1)),
        Level(A=np.array([[pull, 1.0]]), b=np.ones(1)),
        Level(A=np.array([[1.0, 0.0]]), b=np.array([-5.0])),
    ]
    x, norms = optimum(levels)
    np.testing.assert_allclose(x, 0.0, atol=1e-12)
    np.testing.assert_allclose(norms, [0.0, 0.0, 1.0, 5.0], atol=1e-12)


@pytest.mark.parametrize("kind", sorted(set(KINDS) - DECIDED_BY_ROUNDING))
def test_the_solver_finds_what_90_digits_find(kind):
    for seed in range(12):
        levels = problem(kind, seed, n=6, levels=3)
        solution = solve(levels)
        assert solution.status is Status.SOLVED
        norms = optimum(levels)[1]
        np.testing.assert_allclose(slack_norms(levels, solution.x), norms, rtol=1e-6, atol=1e-6)
