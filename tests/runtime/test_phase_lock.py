"""The phase-locked loop follows a drifting, jittering clock, holds over its gaps, and moves no tick far."""

import numpy as np
import pytest
from hapticd.runtime.timing.phase_lock import LOCKED_SHARE, LOST_TICKS, UNLOCKED_SHARE, PhaseLock

PERIOD = 1_000_000


class Clocks:
    """A bus clock and the loop's, in nanoseconds of the loop's."""

    def __init__(self, drift: float, phase: int, jitter: float, seed: int = 1) -> None:
        self.lock = PhaseLock(PERIOD)
        self.bus_period = PERIOD * (1.0 + drift)
        self.phase, self.jitter = phase, jitter
        self.rng = np.random.default_rng(seed)
        self.start, self.tick = 10 * PERIOD, 0
        self.deadlines: list[int] = []

    def run(self, ticks: int, silent: bool = False) -> np.ndarray:
        """Distances from each tick to the middle between two true stamps [ns]."""
        found = []
        for _ in range(ticks):
            deadline = self.start + self.tick * PERIOD
            self.deadlines.append(deadline)
            k = int((deadline - self.phase) // self.bus_period)
            true = self.phase + k * self.bus_period
            late = self.rng.exponential(self.jitter) if self.jitter else 0.0
            stamp = 0 if silent else round(true + late)
            self.start += self.lock.update(deadline, stamp)
            self.tick += 1
            found.append(true + self.bus_period / 2 - deadline)
        return np.array(found)


@pytest.mark.parametrize("drift", [0.0, 50e-6, -100e-6])
@pytest.mark.parametrize("phase", [0, 123_456, 700_000])
def test_the_loop_locks_within_a_second_and_stays(drift: float, phase: int) -> None:
    clocks = Clocks(drift, phase, jitter=0.0)
    clocks.run(1000)
    assert clocks.lock.locked
    assert np.abs(clocks.run(3000)[2000:]).max() < 1000.0


def test_jitter_of_the_stamps_is_averaged() -> None:
    clocks = Clocks(50e-6, 300_000, jitter=30_000.0)
    clocks.run(3000)
    error = clocks.run(3000)
    assert clocks.lock.locked
    assert error.std() < 0.25 * 30_000.0
    assert abs(error.mean() + 30_000.0) < 5_000.0  # stamps come late by their mean


def test_no_tick_is_moved_by_more_than_a_share_of_the_period() -> None:
    clocks = Clocks(0.0, 490_000, jitter=200_000.0)
    clocks.run(2000)
    steps = np.diff(clocks.deadlines)
    assert np.abs(steps - PERIOD).max() <= 0.02 * PERIOD
    assert steps.min() > 0


def test_between_the_two_shares_nothing_changes() -> None:
    lock = PhaseLock(PERIOD)

    def off_by(share: float) -> bool:
        for k in range(500):
            lock.update(k * PERIOD, round((k + 0.5 + share) * PERIOD))
        return lock.locked

    assert not off_by(UNLOCKED_SHARE - 0.02)
    assert off_by(LOCKED_SHARE - 0.02)
    assert off_by(UNLOCKED_SHARE - 0.02)
    assert not off_by(UNLOCKED_SHARE + 0.02)
    assert not off_by(LOCKED_SHARE + 0.02)


def test_without_stamps_the_drift_is_held_and_the_lock_is_lost_in_time() -> None:
    clocks = Clocks(50e-6, 0, jitter=0.0)
    clocks.run(4000)
    error = clocks.run(LOST_TICKS - 1, silent=True)
    assert clocks.lock.locked
    assert np.abs(error).max() < 1000.0
    clocks.run(2, silent=True)
    assert not clocks.lock.locked
    held = clocks.run(2000, silent=True)
    assert np.abs(held).max() < 0.2 * 2000 * 50e-6 * PERIOD  # unheld it would drift by all of it
    clocks.run(1000)
    assert clocks.lock.locked
