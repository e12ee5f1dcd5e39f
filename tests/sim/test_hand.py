"""The scripted hand: its path, its orientation, and its limited strength."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.machines.giant.kinematics import DH, T_BASE_DH
from hapticd.models.dh import forward
from hapticd.sim.hand import Grip, Hand, Path, hanging, turned
from hapticd.sim.hold import Hold

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


def test_the_hand_knows_how_far_and_how_fast_its_place_is_from_the_handle(path: Path) -> None:
    hand, hold = Hand(path, GRIP, hanging), Hold()
    R, _ = hanging([0.0, 1.0, 0.0], [0.0] * 3)
    turn = np.array([0.0, 0.1, 0.5])
    hand.aim(hold, 0.0, [0.01, 0.0, -1.0], pin.exp3(turn) @ R, (0.2, -0.1, 0.0))
    np.testing.assert_allclose(hold.error, [-0.01, 0, 0, *-turn], atol=1e-9)
    np.testing.assert_allclose(hold.rate, [-0.2, 0.1, 0, 0, 0, 0], atol=1e-9)
    hand.aim(hold, 0.4, [0.01, 0.0, -1.0], R)
    value, rate = path.at(0.4)
    np.testing.assert_allclose(hold.rate, [*rate[:3], *hanging(value[3:], rate[3:])[1]])
    assert hold.stiffness.tolist() == [900.0, 30.0] and hold.damping.tolist() == [40.0, 1.2]
    assert hold.strength.tolist() == [150.0, 12.0]
    hand.gripping = False
    hand.aim(hold, 0.4, [0.01, 0.0, -1.0], R)
    assert hold.strength.tolist() == [0.0, 0.0]


def test_rotation_vectors_turn_from_where_the_handle_was_and_their_rate_is_the_angular_velocity() -> None:
    first = pin.exp3(np.array([0.4, -0.2, 1.0]))
    orientation, h = turned(first), 1e-6
    angles, rates = np.array([0.5, -1.1, 0.3]), np.array([0.7, 0.2, -0.9])
    R, omega = orientation(angles, rates)
    later, _ = orientation(angles + h * rates, rates)
    np.testing.assert_allclose(pin.log3(later @ R.T) / h, omega, atol=1e-5)
    np.testing.assert_allclose(orientation([0.0] * 3, [0.0] * 3)[0], first)


def test_a_hand_that_lets_go_leaves_the_handle_alone_until_it_is_back_or_a_person_takes_it() -> None:
    path = Path([0.0, 1.0], np.array([[0.0] * 6, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]]))
    hand = Hand(path, GRIP, hanging, away=[(2.0, 3.0)])

    hold = Hold()

    def pull(t: float) -> float:
        hand.aim(hold, t, (0.0, 0.0, 0.0), np.diag([-1.0, 1.0, -1.0]))
        return float(min(hold.strength[0], hold.stiffness[0] * hold.error[0]))

    assert pull(1.99) == pytest.approx(90.0)
    assert pull(2.0) == pull(2.99) == 0.0
    assert pull(3.0) == pytest.approx(90.0)
    hand.take()
    hand.push((1.0, 0.0, 0.0))
    assert pull(2.5) == pytest.approx(10.0)


def aimed(hand: Hand, t: float, rotation: np.ndarray, position: object = (0.1, -0.2, 0.3)) -> np.ndarray:
    """What a hand tells its hold."""
    hold = Hold()
    hand.aim(hold, t, position, rotation, (0.2, -0.1, 0.0))  # type: ignore[arg-type]
    return np.concatenate([hold.stiffness, hold.damping, hold.strength, hold.error, hold.rate])


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-7, 6e-6, 1e-5, 1e-3, 0.4, 2.0, 3.1, 3.138, 3.1415, np.pi])
def test_the_turn_to_where_the_hand_wants_the_handle_is_the_rotation_vector(size: float) -> None:
    random = np.random.default_rng(1)
    path = Path([0.0, 1.0], np.zeros((2, 6)))
    axes = [*np.eye(3), *-np.eye(3), *random.standard_normal((40, 3))]
    for axis in axes:
        vector = size * axis / np.linalg.norm(axis)
        handle = pin.exp3(random.standard_normal(3))
        target = pin.exp3(vector) @ handle
        hand = Hand(path, GRIP, lambda angles, rates, target=target: (target, (0.0, 0.0, 0.0)))
        turn = aimed(hand, 0.0, handle)[9:12]
        if size < 3.1:
            np.testing.assert_allclose(turn, vector, rtol=1e-6, atol=1e-15)
        np.testing.assert_allclose(pin.exp3(turn) @ handle, target, atol=2e-9)
        np.testing.assert_allclose(turn, pin.log3(target @ handle.T), rtol=1e-9, atol=1e-15)


def test_a_path_of_hanging_handles_is_followed_in_one_go_as_it_is_step_by_step(path: Path) -> None:
    at_once, by_steps = Hand(path, GRIP, hanging), Hand(path, GRIP, lambda *angles: hanging(*angles))
    R = pin.exp3(np.array([0.3, 2.0, -0.4]))
    for t in np.linspace(-0.1, 3.2, 50):
        np.testing.assert_array_equal(aimed(at_once, t, R), aimed(by_steps, t, R))
    assert at_once.handle == by_steps.handle == [0.1, -0.2, 0.3]


def test_another_way_may_be_of_another_kind(path: Path) -> None:
    class Standing:
        def at(self, t: float) -> tuple[list[float], list[float]]:
            return [0.1, 0.2, 0.3, 0.0, 0.0, 0.0], [t, 0.0, 0.0, 0.0, 0.0, 1.0]

    hand, R = Hand(path, GRIP, hanging), np.diag([-1.0, 1.0, -1.0])
    before = aimed(hand, 0.7, R)
    hand.follow(Standing())
    np.testing.assert_allclose(
        aimed(hand, 0.7, R)[6:], [0, 0.4, 0, 0, 0, 0, 0.5, 0.1, 0, 0, 0, -1.0], atol=1e-12
    )
    hand.follow(path)
    np.testing.assert_array_equal(aimed(hand, 0.7, R), before)


def test_what_is_no_pose_of_a_hanging_handle_is_refused() -> None:
    with pytest.raises(ValueError, match="unpack"):
        hanging([0.0, 1.0], [0.0] * 3)
    with pytest.raises(ValueError, match="unpack"):
        Hand(Path(TIMES, PLACES), GRIP, hanging)
    with pytest.raises(AssertionError, match="frame"):
        Hand(Path(TIMES, np.hstack([PLACES, ANGLES])), GRIP, hanging).aim(Hold(3), 0.0, [0.0] * 3, np.eye(3))


def test_a_hand_that_is_led_stays_where_the_handle_was_however_it_is_turned(path: Path) -> None:
    hand, R = Hand(path, GRIP, hanging), np.ascontiguousarray(pin.exp3(np.array([0.3, 2.0, -0.4])))
    aimed(hand, 0.7, R, np.array([0.5, 0.6, 0.7]))
    hand.take()
    R[:], turn = pin.exp3(np.array([0.0, 0.0, 0.2])) @ R, [0.0, 0.0, -0.2]
    np.testing.assert_allclose(
        aimed(hand, 0.8, R)[6:], [0.4, 0.8, 0.4, *turn, -0.2, 0.1, 0, 0, 0, 0], atol=1e-12
    )
