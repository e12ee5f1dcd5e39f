import numpy as np
import pytest
from hapticd.hqp import Status, solve
from hapticd.hqp.certificate import certificate
from hapticd.hqp.generate import KINDS, problem


def test_a_seed_fixes_the_problem():
    first, again = problem("mixed", 5), problem("mixed", 5)
    assert all(a.C.tobytes() == b.C.tobytes() for a, b in zip(first, again, strict=True))


def rows(levels):
    """All rows, scaled to length one, without those of zeros."""
    stacked = np.vstack([part for level in levels for part in (level.A, level.C)])
    norms = np.linalg.norm(stacked, axis=1)
    return stacked[norms > 0] / norms[norms > 0, None], norms


def joined(levels, name):
    return np.concatenate([getattr(level, name) for level in levels])


def test_sizes_reach_sixty_variables_and_twelve_levels():
    sizes = {(problem("dense", seed)[0].n, len(problem("dense", seed))) for seed in range(300)}
    assert min(sizes)[0] == 2 and max(sizes)[0] == 60
    assert {count for _, count in sizes} == set(range(1, 13))


def test_kinds_are_what_they_say():
    made = {kind: problem(kind, 1, n=20, levels=3) for kind in KINDS}
    assert np.linalg.matrix_rank(made["rank_deficient"][0].C) < min(made["rank_deficient"][0].C.shape)
    for kind in ("conflicting", "duplicate"):
        unit, _ = rows(made[kind])
        assert (np.abs(np.triu(unit @ unit.T, 1)) > 1 - 1e-12).any(), kind
    lb, ub = joined(made["equal_bounds"], "lb"), joined(made["equal_bounds"], "ub")
    assert (lb == ub).any() and ((lb != ub) & (np.abs(lb - ub) <= 1e-11 * np.abs(lb))).any()
    infinite = made["infinite_bounds"]
    assert (np.isinf(joined(infinite, "lb")) & np.isinf(joined(infinite, "ub"))).any()
    worst = max(made["infeasible_level"], key=lambda level: len(level.A))
    assert len(worst.A) > worst.n and (worst.ub[:20:2] < worst.lb[1:20:2]).any()
    unit, _ = rows(made["nearly_parallel"])
    closeness = np.triu(np.abs(unit @ unit.T), 1)
    assert ((closeness > 1 - 1e-3) & (closeness < 1)).any()
    _, norms = rows(made["badly_scaled"])
    assert norms.max() / norms.min() > 1e3
    assert (rows(made["zero_rows"])[1] == 0).any()
    vertex = made["degenerate_vertices"]
    assert set(np.unique(joined(vertex, "C"))) <= {-1.0, 0.0, 1.0}
    bounds = np.concatenate([joined(made["unit_rows"], "lb"), joined(made["unit_rows"], "ub")])
    assert set(np.unique(np.abs(bounds))) == {0.0, np.inf}
    assert all((np.sum(level.C != 0, axis=1) == 1).all() for level in made["unit_rows"])
    everything = np.vstack([joined(made["unseen_variables"], "A"), joined(made["unseen_variables"], "C")])
    assert (everything == 0).all(axis=0).any()


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
