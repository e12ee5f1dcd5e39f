"""Cues: pulses that leave nothing behind, one rhythm for each cause, and a bound on what they give out."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hapticd.control.cue import (
    AVATAR_LIMIT,
    ENERGY,
    FAINT,
    FILL,
    LIMIT,
    MOST,
    PERIOD_S,
    QUIET,
    RHYTHMS,
    STOPPED,
    UNLED,
    Cue,
    Rhythm,
    pattern,
)

DT = 1e-3
CAUSES = sorted(RHYTHMS)


def heard(cue: Cue, cause: int, seconds: float, share: float = 1.0) -> np.ndarray:
    return np.array([cue.update(cause, share, 0.0) for _ in range(round(seconds / DT))])


@pytest.mark.parametrize("cause", CAUSES)
def test_an_announcement_leaves_a_free_mass_at_rest_where_it_was(cause: int) -> None:
    force = np.array(pattern(RHYTHMS[cause], DT))
    speed = np.cumsum(force)
    assert np.abs(force).max() == pytest.approx(1.0, abs=0.02)
    assert abs(speed[-1]) < 1e-9 and abs(np.cumsum(speed)[-1]) < 1e-6
    ticks = np.arange(len(force))
    for motion in (np.ones(len(force)), ticks * DT):  # even, evenly accelerated
        assert abs(force @ motion) < 1e-9


@pytest.mark.parametrize("cause", CAUSES)
def test_it_begins_and_ends_smoothly_at_its_own_frequency(cause: int) -> None:
    rhythm, force = RHYTHMS[cause], np.array(pattern(RHYTHMS[cause], DT))
    cycle = round(1.0 / (rhythm.frequency * DT))
    assert abs(force[0]) < 1e-9 and np.abs(force[:3]).max() < 0.05 and force[-1] == 0.0
    assert np.abs(np.diff(force)).max() <= 1.05 * 2.0 * np.pi / cycle
    spectrum = np.abs(np.fft.rfft(force, 10_000))
    peak = np.fft.rfftfreq(10_000, DT)[spectrum.argmax()]
    assert peak == pytest.approx(rhythm.frequency, rel=0.06)


def test_no_two_causes_feel_alike() -> None:
    frequencies = sorted(rhythm.frequency for rhythm in RHYTHMS.values())
    assert min(b / a for a, b in pairwise(frequencies)) > 1.3
    assert CAUSES == [ENERGY, LIMIT, AVATAR_LIMIT, UNLED, STOPPED]


def test_a_cause_is_announced_again_while_it_stands_and_silence_is_silent() -> None:
    cue = Cue(2.0, DT)
    assert not heard(cue, QUIET, 2.0).any() and cue.cause == QUIET
    force = heard(cue, STOPPED, 2.0 * PERIOD_S)
    assert np.array_equal(force[:1000], force[1000:]) and np.abs(force).max() == pytest.approx(2.0, rel=0.02)
    ending = heard(cue, STOPPED, 0.1)
    assert ending.any() and cue.cause == STOPPED
    rest = heard(cue, QUIET, 1.0)
    whole = np.concatenate([ending, rest])
    assert np.array_equal(whole[:1000], force[:1000]), "what has begun is not cut off"
    assert not rest[-500:].any() and cue.cause == QUIET


def test_another_cause_does_not_wait_for_the_period() -> None:
    cue = Cue(2.0, DT)
    first = pattern(RHYTHMS[LIMIT], DT)
    force = heard(cue, LIMIT, DT * len(first))
    following = heard(cue, UNLED, 0.4)
    second = np.array(pattern(RHYTHMS[UNLED], DT))[:400]
    assert np.allclose(force, 2.0 * np.array(first)) and np.allclose(following[: len(second)], 2.0 * second)


def test_the_more_intervenes_the_stronger_the_cue() -> None:
    most = [np.abs(heard(Cue(1.0, DT), AVATAR_LIMIT, 1.0, share)).max() for share in (0.0, 0.5, 1.0, 7.0)]
    assert most == pytest.approx(np.array([FAINT, 0.5 * (1.0 + FAINT), 1.0, 1.0]) * most[2])


@pytest.mark.parametrize("cause", CAUSES)
def test_no_palm_gets_more_energy_out_of_it_than_the_tank_allows(cause: int) -> None:
    """The worst palm moves with the force, as fast as it can."""
    cue, given, most = Cue(5.0, DT), 0.0, 0.0
    force = 0.0
    for k in range(20_000):
        velocity = 0.5 * np.sign(force)
        given += DT * force * velocity
        most = max(most, given - FILL * DT * (k + 1))
        force = cue.update(cause, 1.0, velocity)
    assert MOST < most + 1e-3 < MOST + 2e-3


def test_a_hand_that_moves_evenly_does_not_weaken_it() -> None:
    cue = Cue(2.0, DT)
    force = np.array([cue.update(UNLED, 1.0, 0.2) for _ in range(3000)])
    assert np.abs(force[2000:]).max() == pytest.approx(np.abs(force[:1000]).max())


def test_without_force_there_is_none_and_what_does_not_fit_is_refused() -> None:
    assert not heard(Cue(0.0, DT), STOPPED, 1.5).any()
    with pytest.raises(ValueError, match="does not fit"):
        pattern(Rhythm(400.0, 4, 1), DT)
    with pytest.raises(ValueError, match="does not fit"):
        pattern(Rhythm(10.0, 6, 2), DT)
