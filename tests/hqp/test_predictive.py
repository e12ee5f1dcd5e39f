"""Model predictive control, condensed: limits along a horizon that meet in many vertices."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.hqp import Level, Solver, Status, solve
from hapticd.hqp.certificate import certificate
from numpy.typing import NDArray

Array = NDArray[np.float64]


def horizon(rng: np.random.Generator, steps: int) -> tuple[Array, Array]:
    """Positions and velocities of a mass after each step, (2 steps, steps) times what moves it, and their
    share of where it begins, (2 steps, 2)."""
    dt = rng.choice([0.01, 0.03, 0.1])
    one, moved = np.array([[1.0, dt], [0.0, 1.0]]), np.array([0.5 * dt * dt, dt])
    free, by = np.eye(2), np.zeros((2, steps))
    rows, begins = [], []
    for k in range(steps):
        free, by = one @ free, one @ by
        by[:, k] = moved
        rows.append(by.copy())
        begins.append(free)
    return np.vstack(rows), np.vstack(begins)


def predictive(rng: np.random.Generator, steps: int) -> list[Level]:
    """Bounds on the input, on its steps and on the states, which cannot all be met; then targets."""
    rows, begins = horizon(rng, steps)
    strong, narrow = rng.choice([1.0, 10.0]), rng.choice([0.05, 0.5])
    start, target, one = begins @ rng.normal(size=2), 2.0 * rng.normal(), np.ones(steps)
    slew = np.eye(steps) - np.eye(steps, k=-1)
    return [
        Level(lb=-strong * one, ub=strong * one),
        Level(C=slew, lb=-0.2 * strong * one, ub=0.2 * strong * one),
        Level(C=rows, lb=-narrow - start, ub=narrow - start),
        Level(A=rows[-2:].copy(), b=-start[-2:]),
        Level(A=rows[::2].copy(), b=target - start[::2]),
        Level(A=np.eye(steps), b=np.zeros(steps)),
    ]


@pytest.mark.parametrize("steps", [12, 20, 25, 30, 40])
def test_a_horizon_with_limits_is_solved_with_the_iterations_there_are(steps: int) -> None:
    rng = np.random.default_rng(steps)
    for _ in range(24):
        levels = predictive(rng, steps)
        found = solve(levels)
        assert found.status is Status.SOLVED
        assert max(certificate(levels, found.x)) <= 1e-6


def test_a_horizon_that_moves_on_is_solved_warm() -> None:
    rng = np.random.default_rng(3)
    levels = predictive(rng, 20)
    solver = Solver(20, [level.rows for level in levels])
    for _ in range(60):
        shift = 0.02 * rng.normal(size=2)
        levels[2].lb[:] += np.tile(shift, 20)
        levels[2].ub[:] += np.tile(shift, 20)
        levels[4].b[:] += 0.1 * rng.normal()
        found = solver.solve(levels)
        assert found.status is Status.SOLVED
        assert max(certificate(levels, found.x)) <= 1e-6
