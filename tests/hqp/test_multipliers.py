"""Multipliers of levels, and the rows of a conflict."""

import numpy as np
import pytest
from hapticd.hqp import HqpError, Level, conflicts, multipliers, solve
from hapticd.hqp.certificate import gradient
from hapticd.hqp.generate import KINDS, problem


@pytest.mark.parametrize(
    "kind", ["dense", "degenerate_vertices", "friction_pyramids", "rank_deficient", "duplicate"]
)
def test_they_balance_the_gradient_and_point_outwards(kind):
    assert kind in KINDS
    for seed in range(6):
        levels = problem(kind, seed, n=12, levels=4)
        x = solve(levels).x.copy()
        for p in range(len(levels)):
            g = gradient(levels[p], x)
            found = multipliers(levels, x, p)
            assert len(found) == p
            for level, (of_a, of_c) in zip(levels, found, strict=False):
                g = g + level.A.T @ of_a + level.C.T @ of_c
                inside = (level.C @ x > level.lb + 1e-6) & (level.C @ x < level.ub - 1e-6)
                assert not of_c[inside].any()
                met = np.abs(np.clip(level.C @ x, level.lb, level.ub) - level.C @ x) < 1e-9
                only_lower = met & (level.C @ x < level.ub - 1e-6)
                only_upper = met & (level.C @ x > level.lb + 1e-6)
                assert (of_c[only_lower] <= 1e-6).all() and (of_c[only_upper] >= -1e-6).all()
            assert np.linalg.norm(g) < 1e-6 * (1.0 + np.linalg.norm(gradient(levels[p], x)))


def test_no_multipliers_where_the_point_is_not_optimal():
    levels = [Level(lb=-np.ones(2), ub=np.ones(2)), Level(A=np.eye(2), b=np.array([0.5, 3.0]))]
    with pytest.raises(HqpError, match="gradient"):
        multipliers(levels, np.zeros(2), 1)
    with pytest.raises(HqpError, match="number the levels"):
        multipliers(levels, np.zeros(2), 2)


def test_a_conflict_names_its_rows_in_all_levels_and_no_others():
    limits = Level(C=np.eye(3), lb=np.full(3, -1.0), ub=np.array([1.0, 2.0, 5.0]))
    sums = Level(C=np.array([[1.0, 1.0, 0.0]]), lb=np.array([-np.inf]), ub=np.array([9.0]))
    wish = Level(A=np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), b=np.array([4.0, 0.5]))
    levels = [limits, sums, wish]
    x = solve(levels).x
    found = conflicts(levels, x, 2)
    assert {(c.level, c.part, c.row) for c in found} == {(0, "C", 0), (0, "C", 1), (2, "A", 0)}
    assert conflicts(levels, x, 0) == conflicts(levels, x, 1) == []
    rows = {"A": [level.A for level in levels], "C": [level.C for level in levels]}
    np.testing.assert_allclose(
        sum(c.multiplier * rows[c.part][c.level][c.row] for c in found), 0.0, atol=1e-12
    )


@pytest.mark.parametrize("of", [multipliers, conflicts])
def test_an_x_that_is_not_minimal_at_the_first_level_has_none(of):
    levels = [Level(A=np.ones((1, 2)), b=np.ones(1)), Level(A=np.eye(2), b=np.zeros(2))]
    with pytest.raises(HqpError, match=r"leaves 1\.4e\+00 of the level"):
        of(levels, np.zeros(2), 0)
    assert of(levels, np.full(2, 0.5), 0) == []
