"""Scanning and searching the configurations that hold the hand in one place."""

import numpy as np
import pytest
from hapticd.machines.rhi.manipulability import Shape, direction, force_ellipsoid
from hapticd.machines.rhi.polytope import Polytope, cone, worst_force
from hapticd.machines.rhi.redundant import RedundantArm
from hapticd.machines.rhi.saturation import force_limit
from hapticd.machines.rhi.self_motion import Ellipsoid, close, descend, scan
from hapticd.models import Array

from .rhi_device import LIMIT, MU, X0, U, four_dof, printed_position

BOUNDS = (np.full(4, -np.pi), np.full(4, np.pi))


def objectives(arm: RedundantArm, home: Array, limit: Array, u: Array) -> tuple[Ellipsoid, Ellipsoid]:
    """Free and stiff."""
    shape = Shape.of_home(force_ellipsoid(arm.at(home).J, limit), MU)
    return Ellipsoid(shape.free(direction(u)), limit), Ellipsoid(shape.stiff(direction(u)), limit)


@pytest.fixture(scope="module")
def postures() -> Array:
    return scan(four_dof(), X0, BOUNDS, 4000, seed=2)


def test_every_scanned_posture_holds_the_hand_within_the_bounds(postures: Array) -> None:
    assert len(postures) > 1500
    for q in postures:
        assert np.linalg.norm(printed_position(q) - X0) < 1e-9
    assert (np.abs(postures) <= np.pi).all()
    assert len(scan(four_dof(), np.array([2.0, 0.0]), BOUNDS, 500)) == 0  # out of reach
    narrow = (np.array([0.0, 0.0, -1.0, -2.0]), np.array([1.5, 2.0, 1.0, 2.0]))
    inside = scan(four_dof(), X0, narrow, 500)
    assert len(inside) and (inside >= narrow[0]).all() and (inside <= narrow[1]).all()


def test_closing_takes_several_targets_at_once() -> None:
    targets = np.array([[0.5, 0.1], [0.2, -0.3], [-0.4, 0.3]])
    arm = four_dof()
    q = close(arm, np.array([[0.6, 0.6, 0.4, 0.1]] * 3), targets)
    np.testing.assert_allclose(arm.sweep(q)[0], targets, atol=1e-9)


def test_descent_finds_what_no_scanned_posture_betters(postures: Array) -> None:
    arm = four_dof()
    for objective, force in zip(objectives(arm, np.zeros(4), LIMIT, U), (4.766, 11.967), strict=True):
        costs = objective.cost(arm.sweep(postures)[1])
        q, cost = descend(arm, postures[:40], X0, objective)
        best = np.argmin(cost)
        assert cost[best] <= costs.min()
        np.testing.assert_allclose(printed_position(q[best]), X0, atol=1e-9)
        assert float(force_limit(arm.at(q[best]).J, LIMIT, U)) == pytest.approx(force, rel=1e-3)
        # at an optimum the gradient has no part along the manifold
        slope = objective.gradient(arm.J, arm.dJ)
        null = np.linalg.svd(arm.J)[2][2:]
        assert np.abs(null @ slope).max() < 1e-3


@pytest.mark.parametrize("directions", [U[None], cone(U, np.radians(20.0))])
def test_the_gradient_of_the_polytope_is_that_of_central_differences(directions: Array) -> None:
    arm = four_dof()
    objective = Polytope(LIMIT, directions, worst_condition=4.0)
    Q = np.random.default_rng(1).uniform(-2, 2, (100, 4))
    _, J, dJ = arm.sweep(Q)
    h = 1e-6
    difference = np.stack(
        [
            (objective.cost(arm.sweep(Q + e)[1]) - objective.cost(arm.sweep(Q - e)[1])) / (2 * h)
            for e in h * np.eye(4)
        ],
        axis=1,
    )
    gradient = objective.gradient(J, dJ)
    regular = np.linalg.cond(J) < 100.0
    scale = np.abs(gradient).max(axis=1, keepdims=True)
    assert (np.abs(gradient - difference)[regular] < 1e-5 * scale[regular]).all()


def test_the_smooth_cost_bounds_the_exact_force() -> None:
    arm = four_dof()
    J = arm.sweep(np.random.default_rng(2).uniform(-2, 2, (200, 4)))[1]
    directions = cone(U, np.radians(20.0))
    smooth, exact = np.exp(-Polytope(LIMIT, directions).cost(J)), worst_force(J, LIMIT, directions)
    assert (smooth <= exact * (1 + 1e-12)).all()
    assert (smooth > 0.85 * exact).all()  # the p-norm of 20 loads


def test_a_cone_spreads_evenly_around_its_direction() -> None:
    directions = cone(np.array([0.0, 2.0]), 0.3, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    np.testing.assert_allclose(directions[1], U, atol=1e-15)
    np.testing.assert_allclose(directions[[0, 2]] @ U, np.cos(0.3))


def test_the_robust_polytope_betters_the_ellipsoid_where_it_is_worst(postures: Array) -> None:
    arm = four_dof()
    directions = cone(U, np.radians(20.0))
    _, stiff = objectives(arm, np.zeros(4), LIMIT, U)
    q, cost = descend(arm, postures[:20], X0, stiff)
    ellipsoid = arm.sweep(q[[np.argmin(cost)]])[1]
    condition = float(np.linalg.cond(ellipsoid[0] / LIMIT) ** 2)
    robust, cost = descend(arm, postures[:40], X0, Polytope(LIMIT, directions, condition), 400)
    polytope = arm.sweep(robust[[np.argmin(cost)]])[1]
    assert worst_force(polytope, LIMIT, directions) > worst_force(ellipsoid, LIMIT, directions)
    assert np.linalg.cond(polytope[0] / LIMIT) ** 2 < 1.05 * condition
