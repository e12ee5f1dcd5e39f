"""The scripted hand: its path, its orientation, and its limited strength."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.machines.giant.kinematics import DH, T_BASE_DH
from hapticd.models.dh import forward
from hapticd.sim.hand import Grip, Hand, Path, hanging, turned

GRIP = Grip((900.0, 30.0), (40.0, 1.2), (150.0, 12.0))
TIMES = [0.0, 1.0, 1.5, 3.0]
PLACES = np.array([[0.0, 0.0, -1.0], [0.5, 0.1, -1.0], [0.6, 0.5, -0.9], [0.2, 0.5, -1.1]])
ANGLES = np.array([[0.0, 1.0, 0.0], [1.0, 1.2, 0.1], [4.0, 0.8, 0.0], [7.0, 1.0, -0.5]])


@pytest.fixture
def path() -> Path:
    return Path(TIMES, np.hstack([PLACES, ANGLES]))


def test_the_path_passes_its_poses_and_is_twice_smooth(path: Path) -> None:
    for t, place, angles in zip(TIMES, PLACES, ANGLES, strict=True):
        np.testing.assert_allclose(path.at(t)[0], [*place, *angles], atol=1e-12)
    h = 1e-4
    for t in (0.3, 0.9999, 1.0, 1.0001, 1.5, 2.2):
        before, after = (np.array(path.at(t + k * h)[0]) for k in (-1, 1))
        np.testing.assert_allclose(path.at(t)[1], (after - before) / (2 * h), atol=1e-5)
    for t in (1.0, 1.5):  # no step in the acceleration
        rates = [np.array(path.at(t + k * h)[1]) for k in (-2, -1, 1, 2)]
        np.testing.assert_allclose(rates[1] - rates[0], rates[3] - rates[2], atol=2e-6)


def test_the_ends_are_at_rest_and_held(path: Path) -> None:
    for t in (-1.0, 0.0, 3.0, 9.0):
        value, rate = path.at(t)
        np.testing.assert_allclose(rate, 0.0, atol=1e-12)
        np.testing.assert_allclose(value[:3], PLACES[0 if t <= 0 else -1])


def test_a_path_needs_ascending_times() -> None:
    with pytest.raises(ValueError, match="ascending"):
        Path([0.0, 0.0], PLACES[:2])
    with pytest.raises(ValueError, match="two poses"):
        Path([0.0], PLACES[:1])


def test_yaw_tilt_and_roll_are_the_angles_of_the_giants_handle() -> None:
    q = np.array([0.1, -0.2, 0.7, 1.1, -0.4, 0.5, 0.4, 0.3])
    handle = forward(T_BASE_DH, DH, q)[-1]
    rotation, _ = hanging([q[2] + q[3] + q[4], q[5] + q[6], q[7]], [0.0, 0.0, 0.0])
    np.testing.assert_allclose(rotation, handle[:3, :3], atol=1e-12)


def test_the_angular_velocity_is_the_derivative_of_the_orientation(path: Path) -> None:
    h = 1e-6
    for t in (0.4, 1.2, 2.0):
        value, rate = path.at(t)
        R, omega = hanging(value[3:], rate[3:])
        later, _ = hanging(path.at(t + h)[0][3:], rate[3:])
        np.testing.assert_allclose(pin.log3(later @ R.T) / h, omega, atol=1e-4)


def test_the_hand_pulls_towards_its_path_as_strongly_as_it_can(path: Path) -> None:
    hand = Hand(path, GRIP, hanging)
    R, _ = hanging([0.0, 1.0, 0.0], [0.0] * 3)
    near = hand.update(0.0, [0.01, 0.0, -1.0], R, [0.0] * 6)
    np.testing.assert_allclose(near, [-9.0, 0, 0, 0, 0, 0], atol=1e-9)
    moving = hand.update(0.0, [0.0, 0.0, -1.0], R, [0.1, 0, 0, 0, 0, 0.5])
    np.testing.assert_allclose(moving, [-4.0, 0, 0, 0, 0, -0.6], atol=1e-9)
    far = hand.update(0.0, [3.0, 0.0, -1.0], pin.exp3(np.array([0, 0, 2.0])) @ R, [0.0] * 6)
    assert np.linalg.norm(far[:3]) == pytest.approx(150.0)
    assert np.linalg.norm(far[3:]) == pytest.approx(12.0)
    hand.gripping = False
    assert not hand.update(0.0, [3.0, 0.0, -1.0], R, [0.0] * 6).any()


def test_rotation_vectors_turn_from_where_the_handle_was_and_their_rate_is_the_angular_velocity() -> None:
    first = pin.exp3(np.array([0.4, -0.2, 1.0]))
    orientation, h = turned(first), 1e-6
    angles, rates = np.array([0.5, -1.1, 0.3]), np.array([0.7, 0.2, -0.9])
    R, omega = orientation(angles, rates)
    later, _ = orientation(angles + h * rates, rates)
    np.testing.assert_allclose(pin.log3(later @ R.T) / h, omega, atol=1e-5)
    np.testing.assert_allclose(orientation([0.0] * 3, [0.0] * 3)[0], first)


def test_force_and_torque_of_a_hand_are_limited_each_by_itself() -> None:
    path = Path([0.0, 1.0], np.array([[3.0, 4.0, 0.0, 0.5, 0.2, 0.1]] * 2))
    hand = Hand(path, Grip((100.0, 10.0), (5.0, 1.0), (20.0, 100.0)), turned(np.eye(3)))
    wrench = hand.update(0.5, [0.0] * 3, np.eye(3), [0.0] * 6)
    np.testing.assert_allclose(wrench, [12.0, 16.0, 0.0, 5.0, 2.0, 1.0], atol=1e-12)
    wrench = hand.update(0.5, [2.82, 3.76, 0.0], np.eye(3), [0.0] * 5 + [151.0])  # 30 N, 150 N m
    np.testing.assert_allclose(wrench[:3], [12.0, 16.0, 0.0], atol=1e-12)
    assert np.linalg.norm(wrench[3:]) == pytest.approx(100.0)
    np.testing.assert_allclose(wrench[3:] / wrench[5], [-5.0 / 150.0, -2.0 / 150.0, 1.0], rtol=1e-9)
    wrench = hand.update(0.5, [2.97, 4.0, 0.0], np.eye(3), [0.0] * 6)
    np.testing.assert_allclose(wrench[:3], [3.0, 0.0, 0.0], atol=1e-12)
