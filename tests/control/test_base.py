"""Whatever the paddle says, the base keeps its speeds and accelerations and stops cleanly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hapticd.control.base import Base, BaseLimits

DT = 1e-3
LIMITS = BaseLimits(speed=0.8, rate=1.2, acceleration=0.6, turning=1.5, dead_zone=0.15)
REST = np.zeros(3)


def armed() -> Base:
    base = Base(LIMITS, DT)
    base.update(REST, True)
    return base


@pytest.mark.parametrize("seed", range(6))
def test_random_feet_never_lead_it_beyond_a_limit(seed: int) -> None:
    rng, base = np.random.default_rng(seed), armed()
    seen = [base.velocity.copy()]
    for ticks in rng.integers(1, 800, 15):
        paddle = rng.uniform(-1.5, 1.5, 3) * (rng.uniform(size=3) > 0.3)
        permitted = rng.uniform() > 0.15
        for _ in range(ticks):
            read = paddle + (np.nan if rng.uniform() < 0.0005 else 0.0)
            seen.append(base.update(read, bool(permitted)).copy())
        base.update(REST, True)
        seen.append(base.velocity.copy())
    v = np.array(seen)
    assert np.hypot(v[:, 0], v[:, 1]).max() <= LIMITS.speed + 1e-12
    assert np.abs(v[:, 2]).max() <= LIMITS.rate + 1e-12
    steps = np.diff(v, axis=0) / DT
    assert np.hypot(steps[:, 0], steps[:, 1]).max() <= LIMITS.acceleration + 1e-9
    assert np.abs(steps[:, 2]).max() <= LIMITS.turning + 1e-9
    assert np.abs(v).max() > 0.1


def test_all_of_the_way_is_full_speed_in_every_direction_and_the_dead_zone_is_none() -> None:
    for angle in np.linspace(0.0, 2.0 * np.pi, 8):
        base, towards = armed(), np.array([np.cos(angle), np.sin(angle), 0.0])
        for _ in range(2000):
            base.update(towards, True)
        np.testing.assert_allclose(base.velocity, LIMITS.speed * towards, atol=1e-12)
        base = armed()
        for _ in range(2000):
            base.update((LIMITS.dead_zone - 1e-9) * towards, True)
        assert base.still


def test_the_speed_begins_without_a_step_at_the_edge_of_the_dead_zone() -> None:
    base, speeds = Base(replace(LIMITS, acceleration=1e4, turning=1e4), DT), []
    base.update(REST, True)
    for way in np.linspace(0.0, 1.0, 201):
        speeds.append(base.update(np.array([way, 0.0, way]), True).copy())
    steps = np.diff(speeds, axis=0)
    assert (steps >= -1e-12).all()
    assert steps.max() < 2.0 * LIMITS.rate / 200


@pytest.mark.parametrize("how", ["permission", "nan", "foot"])
def test_a_stop_is_as_short_as_the_acceleration_allows_and_does_not_turn_round(how: str) -> None:
    base, paddle = armed(), np.array([0.9, -0.4, 0.7])
    for _ in range(3000):
        base.update(paddle, True)
    begin = base.velocity.copy()
    inputs = {"permission": (paddle, False), "nan": (np.full(3, np.nan), True), "foot": (REST, True)}
    seen = [begin]
    while not base.still:
        seen.append(base.update(*inputs[how]).copy())
    v = np.array(seen)
    assert (np.diff(np.abs(v), axis=0) <= 1e-12).all()
    needed = max(np.hypot(*begin[:2]) / LIMITS.acceleration, abs(begin[2]) / LIMITS.turning) / DT
    assert len(seen) <= needed + 3


def test_a_foot_that_rests_on_the_paddle_moves_nothing_when_permission_comes() -> None:
    base, paddle = Base(LIMITS, DT), np.array([1.0, 0.0, 0.0])
    for _ in range(500):
        assert not base.update(paddle, True).any()
    base.update(REST, True)
    for _ in range(500):
        base.update(paddle, True)
    assert base.velocity[0] > 0.1
    for _ in range(3000):
        base.update(paddle, False)
    assert base.still
    for _ in range(500):  # permission again, and the foot was never taken off
        assert not base.update(paddle, True).any()


def test_limits_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="positive"):
        BaseLimits(0.0, 1.0, 1.0, 1.0, 0.1)
    with pytest.raises(ValueError, match="dead zone"):
        BaseLimits(1.0, 1.0, 1.0, 1.0, 1.0)
