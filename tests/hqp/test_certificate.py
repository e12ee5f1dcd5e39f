import numpy as np
import pytest
from hapticd.hqp import HqpError, Level
from hapticd.hqp.certificate import certificate, slack_norms, slacks
from hapticd.hqp.multipliers import multipliers


def unit_box(n):
    return Level(C=np.eye(n), lb=-np.ones(n), ub=np.ones(n))


def target(b):
    return Level(A=np.eye(len(b)), b=np.array(b))


def test_slacks_have_the_sign_that_mends_the_row():
    w, v = slacks(
        Level(A=np.eye(2), b=np.ones(2), C=np.eye(2), lb=np.zeros(2), ub=np.ones(2)), np.array([-2.0, 3.0])
    )
    assert w.tolist() == [3.0, -2.0] and v.tolist() == [2.0, -2.0]


def test_the_optimum_is_proven():
    levels, x = [unit_box(2), target([3.0, 0.5])], np.array([1.0, 0.5])
    assert certificate(levels, x).max() < 1e-15
    assert slack_norms(levels, x).tolist() == [0.0, 2.0]


def test_a_point_that_stops_short_is_not_proven():
    assert certificate([unit_box(2), target([3.0, 0.5])], np.array([0.9, 0.5])).max() > 0.1


def test_a_bound_that_pulls_the_wrong_way_proves_nothing():
    assert certificate([unit_box(2), target([0.0, 0.0])], np.array([1.0, 0.0])).max() > 0.1


def test_a_row_left_violated_may_pull_both_ways():
    gap = Level(C=np.array([[1.0], [1.0]]), lb=np.array([2.0, -np.inf]), ub=np.array([np.inf, 0.0]))
    for wish in (-5.0, 5.0):
        assert certificate([gap, target([wish])], np.array([1.0])).max() < 1e-15


def test_the_certificate_does_not_depend_on_row_scale():
    levels, x = [unit_box(2), target([3.0, 0.5])], np.array([0.9, 0.5])
    level = levels[0]
    scaled = [Level(C=1e4 * level.C, lb=1e4 * level.lb, ub=1e4 * level.ub), levels[1]]
    assert np.allclose(certificate(levels, x), certificate(scaled, x))


@pytest.mark.parametrize("judge", [certificate, slack_norms, lambda levels, x: multipliers(levels, x, 0)])
@pytest.mark.parametrize(
    ("levels", "x", "said"),
    [
        ([], np.zeros(2), "levels is empty"),
        (None, np.zeros(2), "levels is of type NoneType"),
        ((level for level in [unit_box(2)]), np.zeros(2), "levels is of type generator"),
        ([unit_box(2), 3.0], np.zeros(2), "levels has an entry of type float"),
        ([unit_box(2)], np.zeros(3), r"x has shape \(3,\)"),
        ([unit_box(2)], [0.0, 0.0], "x is of type list"),
    ],
)
def test_what_is_no_problem_or_no_point_is_refused(judge, levels, x, said):
    with pytest.raises(HqpError, match=said):
        judge(levels, x)
