"""A person who takes the simulated hand and dead-man switch from the script."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.sim.hand import MOST_PUSH_N, PUSH_N, Grip, Hand, Path, PointHand, hanging
from hapticd.sim.hold import Hold
from hapticd.sim.person import DIRECTIONS, SWITCHES, Deed, Hearing, Lead

GRIP = Grip((900.0, 30.0), (40.0, 1.2), (150.0, 12.0))
UPRIGHT = hanging([0.0, 1.0, 0.0], [0.0] * 3)[0]
WALK = Path([0.0, 10.0], np.array([[0.0, 0.0, -1.0, 0.0, 1.0, 0.0], [5.0, 0.0, -1.0, 3.0, 1.0, 0.0]]))


@pytest.fixture
def hand() -> Hand:
    hand = Hand(WALK, GRIP, hanging)
    pull(hand, 5.0, [1.0, 2.0, -1.0])
    return hand


def pull(hand: Hand, t: float, position: list[float]) -> np.ndarray:
    """Force of its spring on a handle at rest."""
    hold = Hold()
    hand.aim(hold, t, position, UPRIGHT)
    return np.asarray(GRIP.stiffness[0] * hold.error[:3] + GRIP.damping[0] * hold.rate[:3])


def test_bytes_that_are_no_deed_are_skipped() -> None:
    assert Hearing().take(bytes([1, 0, 255, 8, 99, 2])) == [Deed.PRESS, Deed.PUSH_DOWN, Deed.RELEASE]
    assert set(DIRECTIONS) | set(SWITCHES) == set(Deed) - {Deed.ENTER_FIELD, Deed.LEAVE_FIELD}


def test_a_hand_that_is_taken_stays_where_the_handle_was(hand: Hand) -> None:
    assert np.linalg.norm(pull(hand, 5.0, [1.0, 2.0, -1.0])) > 100.0  # the script pulls
    hand.take()
    for t in (5.0, 5.5, 60.0):
        np.testing.assert_allclose(pull(hand, t, [1.0, 2.0, -1.0]), 0.0, atol=1e-12)
    away = pull(hand, 60.0, [1.0, 2.0, -1.01])
    np.testing.assert_allclose(away, [0.0, 0.0, 9.0], atol=1e-9)
    hand.take()  # once is enough
    np.testing.assert_allclose(pull(hand, 61.0, [1.0, 2.0, -1.01]), away)


@pytest.mark.parametrize("deed", list(DIRECTIONS))
def test_a_push_pulls_gently_and_in_its_direction(hand: Hand, deed: Deed) -> None:
    hand.push(DIRECTIONS[deed])  # nothing before it is taken
    hand.take()
    at = [1.0, 2.0, -1.0]
    pulls = []
    for _ in range(10):
        hand.push(DIRECTIONS[deed])
        pulls.append(pull(hand, 6.0, at))
    sizes = [float(np.linalg.norm(force)) for force in pulls]
    assert sizes == pytest.approx([PUSH_N * min(k, MOST_PUSH_N / PUSH_N) for k in range(1, 11)])
    np.testing.assert_allclose(pulls[-1] / sizes[-1], DIRECTIONS[deed], atol=1e-9)


def test_a_point_hand_does_the_same() -> None:
    course = Path([0.0, 1.0], np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    hand = PointHand(course, 3000.0, 25.0, 40.0)
    hand.take()
    assert hand.force(5.0, [0.0, 0.0, 0.0], [0.0] * 3) == [0.0, 0.0, 0.0]
    for _ in range(10):
        hand.push(DIRECTIONS[Deed.PUSH_BACK])
    assert hand.force(5.0, [0.0, 0.0, 0.0], [0.0] * 3) == pytest.approx([0.0, -MOST_PUSH_N, 0.0])


def test_a_hand_that_is_led_pulls_to_the_place_with_what_its_grip_has(hand: Hand) -> None:
    hand.lead([9.0, 9.0, 9.0])  # nothing before it is taken
    hand.take()
    hand.lead([1.05, 2.0, -1.0])
    np.testing.assert_allclose(pull(hand, 6.0, [1.0, 2.0, -1.0]), [45.0, 0.0, 0.0], atol=1e-9)
    planar = PointHand(Path([0.0, 1.0], np.array([[0.0, 0.0], [1.0, 0.0]])), 3000.0, 25.0, 40.0)
    planar.take()
    planar.lead([0.0, 9.0, 5.0])
    assert planar.force(5.0, [0.0, 0.0], [0.0] * 2) == pytest.approx([0.0, 40.0])


def test_deeds_and_places_arrive_in_pieces_of_any_size() -> None:
    sent = [Deed.PRESS, Lead((0.5, -1.25, 2.0)), Deed.STRIKE, Lead((0.0, 0.0, 0.25)), Deed.PULL_OUT]
    data = b"".join(each.encode() if isinstance(each, Lead) else bytes([each.value]) for each in sent)
    for size in range(1, len(data) + 1):
        hearing = Hearing()
        heard = [d for at in range(0, len(data), size) for d in hearing.take(data[at : at + size])]
        assert heard == sent
    assert Hearing().take(Lead((float("nan"), 0.0, 0.0)).encode()) == []
