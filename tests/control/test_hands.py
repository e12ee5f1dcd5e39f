"""Glove to hand, and currents to brakes: the map is exact and bounded, the brakes do not chatter."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.control.hands import DWELL_S, FILTER_S, OFF, ON, Brakes, Drive, HandLaw, HandMap, felt_by
from hapticd.devices.sense_glove import GLOVE_JOINTS
from hapticd.models import Array

DT = 1e-3


def squeeze(rng: np.random.Generator, noise: float) -> Array:
    """A grasp of two seconds that builds up, holds just above the threshold, and lets go; (4000,) [A]."""
    slow = np.interp(np.arange(4000) * DT, [0.0, 0.5, 1.5, 2.5, 3.5, 4.0], [0.05, 0.05, 0.4, 0.4, 0.05, 0.05])
    return np.asarray(slow + noise * rng.standard_normal(4000))


def switches(states: list[bool]) -> int:
    return int(np.abs(np.diff(np.array(states, int))).sum())


def test_a_bare_threshold_chatters_and_a_brake_does_not() -> None:
    """Judged on other seeds than the figures were tuned with."""
    bare, braked = [], []
    for seed in range(100, 120):
        current = squeeze(np.random.default_rng(seed), 0.03)
        brakes = Brakes([[0]], DT)
        bare.append(switches((current > ON).tolist()))
        braked.append(switches([bool(brakes.update(np.array([i]))[0]) for i in current]))
    assert np.mean(bare) > 90
    assert max(braked) == 2


@pytest.mark.parametrize("seed", range(10))
def test_whatever_the_current_no_brake_turns_twice_within_its_dwell(seed: int) -> None:
    rng = np.random.default_rng(seed)
    brakes = Brakes([[0, 1], [2], []], DT)
    changed = np.full(3, -1000)
    before = brakes.closed.copy()
    currents = np.repeat(rng.uniform(-2.0, 2.0, (40, 3)), rng.integers(1, 200, 40), axis=0)
    seen, gain = np.zeros(3), 1.0 - np.exp(-DT / FILTER_S)
    for k, current in enumerate(currents):
        closed = brakes.update(current)
        assert brakes.bits == sum(1 << i for i in np.flatnonzero(closed))
        felt = np.maximum([max(current[0], current[1]), current[2], 0.0], 0.0)
        seen += gain * (felt - seen)
        for i in np.flatnonzero(closed != before):
            assert k - changed[i] >= DWELL_S / DT
            # a second implementation of the filter says that there was a reason
            assert seen[i] > ON - 1e-9 if closed[i] else seen[i] < OFF + 1e-9
            changed[i] = k
        before = closed.copy()
    assert not brakes.closed[2]
    assert (changed[:2] > 0).all()
    brakes.update(np.full(3, 2.0))
    brakes.release()
    assert not brakes.closed.any() and brakes.bits == 0


def test_a_brake_closes_within_a_tenth_of_a_second_of_a_firm_grasp_and_opens_again() -> None:
    brakes = Brakes([[0]], DT)
    closing = next(k for k in range(1000) if brakes.update(np.array([0.8]))[0])
    assert closing * DT < 0.03
    opening = next(k for k in range(1000) if not brakes.update(np.array([0.0]))[0])
    assert opening * DT < 0.1


def test_fingers_that_open_against_something_are_not_held() -> None:
    brakes = Brakes([[0]], DT)
    for _ in range(1000):
        assert not brakes.update(np.array([-0.9]))[0]


def test_release_waits_for_nothing() -> None:
    brakes = Brakes([[0], [1]], DT)
    for _ in range(100):
        brakes.update(np.array([0.8, 0.8]))
    assert brakes.bits == 0b11
    brakes.release()
    assert brakes.bits == 0
    assert not brakes.update(np.array([0.8, 0.0])).any()  # and begins anew


def test_a_current_that_is_no_number_closes_nothing_and_is_forgotten() -> None:
    brakes = Brakes([[0]], DT)
    for _ in range(200):
        assert not brakes.update(np.array([np.nan]))[0]
    for _ in range(200):
        brakes.update(np.array([0.8]))
    assert brakes.closed[0]


@pytest.mark.parametrize("seed", range(10))
def test_the_map_is_the_clipped_affine_one_and_never_leaves_the_ranges(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drives = []
    for _ in range(9):
        used = rng.choice(len(GLOVE_JOINTS), 3, replace=False)
        weights = {GLOVE_JOINTS[j]: float(w) for j, w in zip(used, rng.uniform(-1.0, 1.0, 3), strict=True)}
        lower = float(rng.uniform(-0.5, 0.2))
        drives.append(Drive(weights, float(rng.uniform(-0.2, 0.2)), lower, lower + 1.0))
    hand = HandMap(GLOVE_JOINTS, drives)
    for angle in rng.uniform(-3.0, 3.0, (50, 20)):
        target = hand.update(angle)
        for drive, found in zip(drives, target, strict=True):
            wanted = drive.offset + sum(w * angle[GLOVE_JOINTS.index(n)] for n, w in drive.weights.items())
            assert found == pytest.approx(min(max(wanted, drive.lower), drive.upper), abs=1e-12)


def test_a_joint_that_the_glove_lost_leaves_its_drives_where_they_are() -> None:
    hand = HandMap(
        GLOVE_JOINTS,
        [Drive({"index_middle": 1.0}, 0.0, 0.0, 2.0), Drive({"ring_middle": 1.0}, 0.0, 0.0, 2.0)],
    )
    hand.update(np.full(20, 0.5))
    angle = np.full(20, 1.0)
    angle[GLOVE_JOINTS.index("index_middle")] = np.nan
    np.testing.assert_array_equal(hand.update(angle), [0.5, 1.0])


def test_a_map_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match=r"no joint 'index'; it has thumb_abduction"):
        HandMap(GLOVE_JOINTS, [Drive({"index": 1.0}, 0.0, 0.0, 1.0)])
    with pytest.raises(ValueError, match="is empty"):
        HandMap(GLOVE_JOINTS, [Drive({}, 0.0, 1.0, 1.0)])


def test_targets_follow_at_bounded_speed_and_stay_where_they_were_led_last() -> None:
    names = ["index_proximal", "ring_proximal"]
    law = HandLaw(HandMap(GLOVE_JOINTS, [Drive({n: 1.0}, 0.0, 0.0, 1.5) for n in names]), 2.0, DT)
    law.reset(np.array([0.4, 9.0]))
    assert law.target.tolist() == [0.4, 1.5], "from where the drives are, inside their range"
    law.reset(np.array([np.nan, 1.0]))
    assert law.target.tolist() == [0.4, 1.0]
    before = law.target.copy()
    for k in range(300):
        law.update(np.full(20, 1.2), share := min(1.0, k / 100))
        assert np.abs(law.target - before).max() <= share * 2.0 * DT + 1e-12
        before = law.target.copy()
    assert 0.4 + 2.0 * DT * 200 < law.target[0] < 1.2
    for _ in range(400):
        law.update(np.full(20, 1.2), 1.0)
    np.testing.assert_allclose(law.target, 1.2)


def test_a_finger_feels_the_drives_that_carry_its_name() -> None:
    drives = ("thumb_flexion", "index_distal", "index_proximal", "ring_little", "spread")
    assert felt_by(drives, ("thumb", "index", "middle", "ring", "little")) == [[0], [1, 2], [], [3], [3]]
