"""Ellipsoids and their divergence: the paper's own numbers, invariances, central differences."""

import numpy as np
import pytest
from hapticd.machines.rhi.manipulability import (
    Shape,
    direction,
    force_ellipsoid,
    stein,
    stein_gradient,
    velocity_ellipsoid,
)
from hapticd.machines.rhi.redundant import RedundantArm

from .rhi_device import LIMIT, MU, U, four_dof, home_shape, three_dof
from .test_redundant import spatial

THREE_LIMIT = np.full(3, 0.5)
THREE_START = np.array([np.pi / 3, -np.pi / 3, -3 * np.pi / 4])


def random_spd(rng: np.random.Generator, m: int) -> np.ndarray:
    X = rng.standard_normal((m, m))
    return X @ X.T + 0.1 * np.eye(m)


def test_home_ellipsoid_and_desired_shapes_are_those_of_the_paper() -> None:
    arm = four_dof()
    eigenvalues = np.linalg.eigvalsh(force_ellipsoid(arm.at(np.zeros(4)).J, LIMIT))
    np.testing.assert_allclose(eigenvalues, [16.721, 24.603], rtol=1e-4)
    shape = home_shape(arm)
    assert shape.major == pytest.approx(123.0, rel=1e-2) and shape.minor == pytest.approx(3.344, rel=1e-3)
    np.testing.assert_allclose(shape.free(direction(U)), np.diag([shape.major, shape.minor]))
    np.testing.assert_allclose(shape.stiff(direction(U)), np.diag([shape.minor, shape.major]))
    duration = 0.003 * np.linalg.norm(shape.free(direction(U)) - shape.stiff(direction(U)))
    assert duration == pytest.approx(0.508, rel=1e-2)  # (19)


def test_the_example_starts_with_the_eigenvalues_of_the_paper() -> None:
    eigenvalues = np.linalg.eigvalsh(force_ellipsoid(three_dof().at(THREE_START).J, THREE_LIMIT))
    np.testing.assert_allclose(eigenvalues, [2.58, 5.79], rtol=1e-2)


def test_desired_ellipsoids_have_their_axes_along_and_across_any_direction() -> None:
    shape = Shape(9.0, 2.0)
    u = np.array([3.0, -1.0, 2.0])
    for D, along, across in ((shape.free(direction(u)), 2.0, 9.0), (shape.stiff(direction(u)), 9.0, 2.0)):
        np.testing.assert_allclose(D @ u, along * u)
        np.testing.assert_allclose(np.linalg.eigvalsh(D), sorted([along, across, across]))


def test_the_divergence_is_one_and_survives_inversion() -> None:
    rng = np.random.default_rng(1)
    for m in (2, 3):
        A, B, X = random_spd(rng, m), random_spd(rng, m), rng.standard_normal((m, m))
        assert stein(A, A) == pytest.approx(0.0, abs=1e-12)
        assert stein(A, B) > 0.0
        assert stein(A, B) == pytest.approx(stein(B, A))
        assert stein(np.linalg.inv(A), np.linalg.inv(B)) == pytest.approx(stein(A, B))
        assert stein(X @ A @ X.T, X @ B @ X.T) == pytest.approx(stein(A, B))


@pytest.mark.parametrize("make", [four_dof, three_dof, spatial])
def test_gradient_is_that_of_central_differences(make: type[RedundantArm]) -> None:
    arm = make()
    rng = np.random.default_rng(2)
    limit = rng.uniform(0.5, 3.0, arm.n)
    B = random_spd(rng, arm.m)
    h = 1e-5
    for q in rng.uniform(-np.pi, np.pi, (1000, arm.n)):
        J, dJ = arm.at(q).J.copy(), arm.dJ.copy()
        gradient = stein_gradient(J, dJ, limit, B)
        # Richardson's extrapolation: differences good to the fourth order
        steps = np.concatenate([s * h * np.eye(arm.n) for s in (1, -1, 2, -2)])
        v = stein(velocity_ellipsoid(arm.sweep(q + steps)[1], limit), B).reshape(4, -1)
        difference = (8 * (v[0] - v[1]) - (v[2] - v[3])) / (12 * h)
        if np.linalg.cond(J) < 1e3:
            assert np.linalg.norm(gradient - difference) < 1e-7 * np.linalg.norm(gradient) + 1e-9


def test_stacks_are_single_postures_side_by_side() -> None:
    arm = four_dof()
    _, J, dJ = arm.sweep(np.random.default_rng(3).uniform(-2, 2, (5, 4)))
    B = np.diag([0.1, 0.02])
    gradients = stein_gradient(J, dJ, LIMIT, B)
    costs = stein(velocity_ellipsoid(J, LIMIT), B)
    for i in range(5):
        np.testing.assert_allclose(gradients[i], stein_gradient(J[i], dJ[i], LIMIT, B), rtol=1e-13)
        assert costs[i] == pytest.approx(float(stein(velocity_ellipsoid(J[i], LIMIT), B)), rel=1e-13)


def test_mu_spreads_the_eigenvalues_both_ways() -> None:
    shape = Shape.of_home(np.diag([4.0, 10.0]), MU)
    assert (shape.major, shape.minor) == (50.0, pytest.approx(0.8))
