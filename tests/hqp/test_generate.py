import numpy as np
import pytest
from hapticd.hqp import Status, solve
from hapticd.hqp.certificate import certificate
from hapticd.hqp.generate import KINDS, problem


def test_a_seed_fixes_the_problem():
    first, again = problem("mixed", 5), problem("mixed", 5)
    assert all(a.C.tobytes() == b.C.tobytes() for a, b in zip(first, again, strict=True))


def test_kinds_are_what_they_say():
    assert any((level.C == 0.0).all(axis=1).any() for level in problem("zero_rows", 1, n=20, levels=3))
    angles = [level.A for level in problem("nearly_parallel", 1, n=20, levels=3)]
    assert all(a.shape[1] == 20 for a in angles)
    assert any((level.lb == level.ub).any() for level in problem("equal_bounds", 1, n=20, levels=3))
    assert np.linalg.matrix_rank(problem("rank_deficient", 1, n=20, levels=1)[0].C) < 20


# What once went wrong: clashes in circles, rounding taken for a multiplier, a false minimum of the descent.
STUBBORN = [
    ("badly_scaled", (32, 721, 823)),
    ("mixed", (0, 292)),
    ("nearly_parallel", (10, 32, 49, 140, 142, 144, 153, 261, 297, 397, 517, 891, 1253, 1283, 1426, 1456)),
    ("rank_deficient", (270,)),
]


@pytest.mark.parametrize(("kind", "seeds"), STUBBORN)
def test_stubborn_problems_are_solved_and_proven(kind, seeds):
    for seed in seeds:
        levels = problem(kind, seed)
        solution = solve(levels)
        assert solution.status is Status.SOLVED, seed
        assert certificate(levels, solution.x).max() < 1e-6, seed


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_solved_and_proven(kind):
    for seed in range(80):
        levels = problem(kind, seed)
        solution = solve(levels)
        assert solution.status is Status.SOLVED, seed
        assert certificate(levels, solution.x).max() < 1e-6, seed
