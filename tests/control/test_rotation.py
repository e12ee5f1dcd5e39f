"""Rotation vectors against pinocchio's, and a free body against the closed form."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.binding import pointer
from hapticd.control._kernels import lib


def log(R: np.ndarray) -> np.ndarray:
    out, R = np.zeros(3), np.ascontiguousarray(R)
    lib.rotation_log(pointer(R, "const double", 3, 3), pointer(out, "double", 3))
    return out


def exp(vector: np.ndarray) -> np.ndarray:
    R = np.zeros((3, 3))
    lib.rotation_exp(pointer(vector, "const double", 3), pointer(R, "double", 3, 3))
    return R


@pytest.mark.parametrize(
    "angle", [0.0, 1e-12, 1e-8, 1e-5, 1e-3, 1.0, 2.0, 3.1, np.pi - 1e-4, np.pi - 1e-7, np.pi - 1e-9]
)
def test_exp_and_log_are_those_of_pinocchio_at_every_angle(angle: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        axis = rng.standard_normal(3)
        vector = angle * axis / np.linalg.norm(axis)
        R = exp(vector)
        np.testing.assert_allclose(R, pin.exp3(vector), atol=1e-14)
        np.testing.assert_allclose(exp(log(R)), R, atol=3e-8)
        if angle < np.pi - 1e-5:
            np.testing.assert_allclose(log(R), vector, atol=1e-9)


def test_a_half_turn_about_any_axis_has_a_logarithm_of_length_pi() -> None:
    for axis in (*np.eye(3), np.array([0.6, 0.8, 0.0]), np.array([-2.0, 1.0, 2.0]) / 3.0):
        vector = log(2.0 * np.outer(axis, axis) - np.eye(3))
        assert np.linalg.norm(vector) == pytest.approx(np.pi)
        assert abs(vector @ axis) == pytest.approx(np.pi)


def test_a_free_body_moves_as_under_constant_acceleration() -> None:
    p, R, v = np.zeros(3), np.eye(3), np.array([1.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    a = np.array([0.0, 2.0, 0.0, 0.0, 0.0, -1.0])
    state = [pointer(x, "double", *x.shape) for x in (p, R, v, a)]
    for _ in range(500):
        lib.rotation_advance_body(*state, 1e-3)
    np.testing.assert_allclose(p, [0.5, 0.25, 0.0], atol=1e-12)
    np.testing.assert_allclose(v, [1.0, 1.0, 0.0, 0.0, 0.0, 1.5], atol=1e-12)
    np.testing.assert_allclose(log(R), [0.0, 0.0, 2.0 * 0.5 - 0.5 * 0.25], atol=1e-12)
