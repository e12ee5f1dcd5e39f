"""What follows its lead, and what is too heavy."""

import numpy as np
import pytest
from hapticd.control.ability import Ability
from hapticd.control.following import DOUBT, DOUBT_S, Following

LEASH, MOST, ABLE = np.array([0.1, 0.2, 0.3]), np.array([10.0, 20.0, 30.0]), np.array([50.0, 60.0, 70.0])
LONGEST, LATELY, GAIN, DT = 3, 4, np.array([100.0, 200.0, 300.0]), 1e-2


def made(qdd: np.ndarray | None = None) -> tuple[Following, np.ndarray, Ability]:
    link, ability = np.zeros(3), Ability(3)
    names, planned = ("first", "second", "third"), np.zeros(3) if qdd is None else qdd
    watch = Following(names, link, LEASH, MOST, LONGEST, ability, ABLE, LATELY, planned, GAIN, DT)
    return watch, link, ability


def test_a_joint_is_astray_beyond_its_leash_or_where_it_is_no_number() -> None:
    following, link, _ = made()
    rng = np.random.default_rng(0)
    for _ in range(200):
        link[:], following.led[:] = rng.uniform(-0.3, 0.3, 3), rng.uniform(-0.1, 0.1, 3)
        link[rng.random(3) < 0.1] = np.nan
        leash = None if rng.random() < 0.5 else rng.uniform(0.0, 0.4, 3)
        following.judge(leash, False)
        expected = ~(np.abs(link - following.led) <= (LEASH if leash is None else leash))
        assert following.astray == expected.tolist()
        assert (following.astray is following.nowhere) == (not expected.any())


def test_a_motor_that_is_strained_for_longer_than_a_while_does_not_follow() -> None:
    following, _, ability = made()
    ability.strain[:] = -10.1, 20.1, np.nan
    for tick in range(1, 8):
        following.judge(None, True)
        assert following.astray == [tick > LONGEST] * 2 + [False]
    ability.strain[0] = 0.0
    following.judge(None, False)  # it does not count in this tick
    assert following.astray == [True, True, False]
    following.judge(None, True)
    assert following.astray == [False, True, False]
    following.reset(np.full(3, 0.05))
    following.judge(None, True)
    assert following.astray == [False] * 3 and following.led == pytest.approx(0.05)


def test_the_first_motor_that_has_too_little_is_told_for_a_while() -> None:
    following, _, ability = made()
    following.weigh()
    assert following.overload == ""
    ability.load[:] = np.nan, -60.1, 70.1
    following.weigh()
    assert following.overload == "second"
    ability.load[:] = 50.0, 60.0, 70.0
    told = []
    for _ in range(LATELY + 1):
        following.weigh()
        told.append(following.overload)
    assert told == ["second"] * LATELY + [""]


def test_what_accelerations_took_lately_may_be_wrong_by_a_part() -> None:
    qdd = np.array([4.0, -2.0, 0.0])
    following, link, ability = made(qdd)
    ability.inertia[:] = [[5.0, 1.0, 0.0], [1.0, 8.0, 0.5], [0.0, 0.5, 2.0]]
    torque = np.abs(ability.inertia @ qdd)
    for tick in range(60):
        doubt = DOUBT * torque * np.exp(-tick * DT / DOUBT_S)
        link[:], ability.strain[:] = LEASH + doubt / GAIN - 1e-9, MOST + doubt - 1e-9
        following.judge(None, True)
        assert following.astray is following.nowhere
        qdd[:] = 0.0
    link[:], ability.strain[:] = LEASH, MOST + doubt
    for tick in range(1, LONGEST + 2):
        following.judge(None, True)
        assert following.astray == [tick > LONGEST] * 3
    following.reset(link)
    qdd[:] = 4.0, -2.0, 0.0
    link[:] = LEASH + DOUBT * torque / GAIN + 1e-9
    following.led[:] = 0.0
    following.judge(None, False)
    assert following.astray == [True] * 3
    qdd[:] = 0.0
    following.reset(np.zeros(3))
    link[:] = LEASH + 1e-9
    following.judge(None, False)
    assert following.astray == [True] * 3, "no doubt is left of before a start"
