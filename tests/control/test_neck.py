"""Whatever the tracker says, the neck arm's target keeps its limits and stops cleanly."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.neck import Neck, NeckLimits
from hapticd.models import Array

DT = 1e-3
LIMITS = NeckLimits(
    np.array([0.15, 0.12, 0.1]),
    np.array([0.5, 0.7, 1.2]),
    speed=0.6,
    rate=2.5,
    acceleration=4.0,
    turning=15.0,
)
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])


def quaternion(turned: Array) -> Array:
    return np.array(pin.Quaternion(pin.exp3(turned)).coeffs())


def follow(neck: Neck, position: Array, turned: Array, ticks: int) -> None:
    for _ in range(ticks):
        neck.update(position, quaternion(turned))


@pytest.mark.parametrize("seed", range(6))
def test_random_heads_that_get_lost_never_lead_it_beyond_a_limit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    neck, spans = Neck(LIMITS, DT), rng.integers(1, 400, 25)
    seen: list[Array] = []
    here, leaning = np.zeros(3), np.zeros(3)
    for ticks in spans:
        place, turned = rng.normal(0.0, 0.15, 3), rng.normal(0.0, 0.5, 3)
        what = rng.uniform()
        if what < 0.6:
            neck.recentre()
        elif what < 0.7:
            neck.stop()
        jumps, before = rng.uniform() < 0.1, (here, leaning)
        for k in range(ticks):
            share = 1.0 if jumps else (k + 1) / ticks
            here, leaning = (a + share * (b - a) for a, b in zip(before, (place, turned), strict=True))
            bad = rng.uniform() < 0.0005
            read = here + 1e-3 * rng.standard_normal(3) + (np.nan if bad else 0.0)
            neck.update(read, quaternion(leaning))
            seen.append(np.concatenate([neck.position, neck.rotation, neck.velocity, neck.rate]))
    at, speed = np.array(seen)[:, :6], np.array(seen)[:, 6:]
    assert (np.abs(at) <= np.concatenate([LIMITS.reach, LIMITS.turn])).all()
    assert (np.abs(speed) <= np.repeat([LIMITS.speed, LIMITS.rate], 3) + 1e-12).all()
    sharp = np.abs(np.diff(speed, axis=0)) / DT
    assert (sharp <= np.repeat([LIMITS.acceleration, LIMITS.turning], 3) + 1e-6).all()
    np.testing.assert_allclose(np.diff(at, axis=0), speed[1:] * DT, atol=1e-12)
    assert np.abs(at).max() > 0.05


def test_it_goes_where_the_head_goes_seen_from_where_it_was_recentred() -> None:
    neck, home, turned = Neck(LIMITS, DT), np.array([1.0, 2.0, 1.3]), np.array([0.0, 0.0, 0.8])
    follow(neck, home, turned, 10)
    assert not neck.position.any()  # until somebody says where the middle is
    neck.recentre()
    R = pin.exp3(turned)
    step, nod = np.array([0.05, -0.03, 0.04]), np.array([0.1, 0.2, -0.3])
    moved = np.array(pin.log3(R @ pin.exp3(nod)))
    follow(neck, home + R @ step, moved, 2000)
    np.testing.assert_allclose(neck.position, step, atol=1e-4)
    np.testing.assert_allclose(neck.rotation, nod, atol=1e-4)
    assert np.abs(neck.velocity).max() < 1e-3
    neck.recentre()  # here is the middle now: it goes back, as fast as it may
    follow(neck, home + R @ step, moved, 2000)
    np.testing.assert_allclose(neck.position, 0.0, atol=1e-4)


def test_a_head_that_goes_too_far_is_followed_to_the_edge() -> None:
    neck = Neck(LIMITS, DT)
    follow(neck, np.zeros(3), np.zeros(3), 1)
    neck.recentre()
    for share in (0.5, 1.0):
        follow(neck, share * np.array([0.25, -0.25, 0.0]), np.zeros(3), 1000)
    np.testing.assert_allclose(neck.position, [0.15, -0.12, 0.0], atol=1e-4)


@pytest.mark.parametrize("how", ["stop", "nan", "jump", "no quaternion"])
def test_a_stop_is_clean_and_lasts_until_it_is_recentred(how: str) -> None:
    neck, away = Neck(LIMITS, DT), np.array([0.1, 0.05, 0.0])
    follow(neck, np.zeros(3), np.zeros(3), 1)
    neck.recentre()
    follow(neck, away, np.zeros(3), 150)
    moving = neck.velocity.copy()
    assert moving[0] > 0.1
    readings = {
        "stop": (away, UPRIGHT),
        "nan": (np.full(3, np.nan), UPRIGHT),
        "jump": (np.array([2.0, 0.0, 0.0]), UPRIGHT),
        "no quaternion": (away, np.zeros(4)),
    }
    if how == "stop":
        neck.stop()
    speeds = []
    for _ in range(400):
        neck.update(*readings[how])
        speeds.append(neck.velocity.copy())
    falling = np.abs(np.array([moving, *speeds]))
    assert (np.diff(falling, axis=0) <= 1e-15).all()  # no swing, no turning round
    assert not falling[-1].any()
    assert np.count_nonzero(falling[:, 0]) <= moving[0] / (LIMITS.acceleration * DT) + 2
    there = neck.position.copy()
    follow(neck, away, np.zeros(3), 200)  # the head is back, or goes on: nobody said so
    np.testing.assert_array_equal(neck.position, there)
    neck.recentre()
    follow(neck, away, np.zeros(3), 2000)
    np.testing.assert_allclose(neck.position, 0.0, atol=1e-4)


def test_jitter_of_a_tracker_is_smoothed() -> None:
    rng, neck = np.random.default_rng(1), Neck(LIMITS, DT)
    follow(neck, np.zeros(3), np.zeros(3), 1)
    neck.recentre()
    places = []
    for _ in range(3000):
        neck.update(1e-3 * rng.standard_normal(3), UPRIGHT)
        places.append(neck.position.copy())
    assert np.std(places[500:]) < 0.3e-3
