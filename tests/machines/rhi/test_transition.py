"""Transitions between the ellipsoids: (17) and (18), latched, continuous, free of chatter."""

from math import cos, pi

import pytest
from hapticd.machines.rhi.transition import Thresholds, Transition

DT = 1e-3
T = 0.508


@pytest.fixture
def transition() -> Transition:
    return Transition(Thresholds(0.7, 0.95), DT)


def test_activation_follows_17_and_18(transition: Transition) -> None:
    assert transition.update(0.71, 0.71, T) == 1.0
    for k in range(1, 600):
        t = min(k * DT, T)
        assert transition.update(0.6, 0.6, T) == pytest.approx(0.5 * (1 + cos(pi * t / T)), abs=1e-12)
    assert transition.omega == 0.0
    for k in range(1, 600):
        t = min(k * DT, T)
        assert transition.update(0.99, 0.99, T) == pytest.approx(0.5 * (1 - cos(pi * t / T)), abs=1e-12)
    assert transition.omega == 1.0
    assert transition.changes == 2


def test_between_the_thresholds_nothing_changes(transition: Transition) -> None:
    transition.update(0.69, 0.69, T)
    for V in (0.72, 0.94, 0.7, 0.95):
        transition.update(V, V, T)
        assert transition.stiff
    assert transition.changes == 1


def test_a_reversal_on_the_way_starts_from_where_it_is(transition: Transition) -> None:
    before = [transition.update(0.5, 0.5, T) for _ in range(200)]
    after = [transition.update(1.0, 1.0, T) for _ in range(201)]
    assert abs(after[0] - before[-1]) < 0.005
    assert after[-1] == pytest.approx(1.0)
    assert before[::-1][1:] == pytest.approx(after[:-2])  # the same way back


def test_the_return_asks_what_the_free_posture_would_leave(transition: Transition) -> None:
    transition.update(0.5, 0.5, T)
    for _ in range(1000):  # the stiff posture carries the load with ease; the free one could not
        transition.update(0.99, 0.4, T)
    assert transition.stiff and transition.omega == 0.0


def test_the_way_to_stiff_is_the_faster_the_less_reserve_there_is_and_the_way_back_is_not() -> None:
    hasty = Transition(Thresholds(0.7, 0.95), DT, urgency=3.0)
    hasty.update(0.7 - 1e-9, 0.5, T)
    assert hasty.phase == pytest.approx(DT / T) and hasty.haste == pytest.approx(1.0)
    for reserve, haste in ((0.35, 2.0), (0.0, 3.0), (0.8, 1.0)):
        before = hasty.phase
        hasty.update(reserve, 0.5, T)
        assert hasty.haste == pytest.approx(haste)
        assert hasty.phase - before == pytest.approx(haste * DT / T)
    before = hasty.phase
    hasty.update(0.0, 0.99, T)
    assert hasty.haste == 1.0 and before - hasty.phase == pytest.approx(DT / T)


def test_after_a_contact_it_waits_for_another() -> None:
    patient = Transition(Thresholds(0.7, 0.95), DT, linger=0.1)
    patient.update(0.5, 0.5, 0.0)
    for _ in range(3):  # taps, each before the wait is over
        for _ in range(100):
            assert patient.update(1.0, 1.0, 0.0) == 0.0 and patient.stiff
        assert patient.update(0.5, 0.5, 0.0) == 0.0
    for _ in range(100):
        assert patient.update(1.0, 1.0, 0.0) == 0.0
    assert patient.update(1.0, 1.0, 0.0) == 1.0
    assert patient.changes == 2


def test_without_a_duration_it_jumps(transition: Transition) -> None:
    assert transition.update(0.5, 0.5, 0.0) == 0.0
    assert transition.update(1.0, 1.0, 0.0) == 1.0


def test_a_reset_is_free(transition: Transition) -> None:
    transition.update(0.1, 0.1, 0.0)
    transition.reset()
    assert transition.omega == 1.0 and not transition.stiff


@pytest.mark.parametrize(("leave", "back"), [(0.9, 0.9), (0.95, 0.7), (-0.1, 0.5), (0.5, 1.1)])
def test_thresholds_that_would_chatter_are_refused(leave: float, back: float) -> None:
    with pytest.raises(ValueError, match="hysteresis"):
        Thresholds(leave, back)
