"""The PPU's reference and its velocity bounds."""

from math import atan, pi, sqrt

import numpy as np
import pytest
from hapticd.control.prepositioning import PpuLimits, Prepositioning, reference
from hapticd.models.dh import forward
from hapticd.models.giant import DH, T_BASE_DH, Branch, inverse_kinematics

LIMITS = PpuLimits((-1.6, -1.9), (1.6, 1.9), 1.2, 3.0, 0.05)
DT = 1e-3


def test_at_the_reference_joints_2_and_3_take_their_best_angles_and_the_handle_stays() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        q = rng.uniform([-3, 0.5, -2, 0.1, 0.3, -1], [3, 2.3, 1, 1.1, 1.0, 1])
        ppu = rng.uniform(-1.0, 1.0, 2)
        handle = forward(T_BASE_DH, DH, np.concatenate([ppu, q]))[-1]
        moved = np.array(reference(q.tolist(), ppu.tolist()))
        there = inverse_kinematics(handle, moved, Branch(raised=q[3] > 0))
        assert there[1] == pytest.approx(pi / 2, abs=1e-9)
        assert (there[2] + atan(0.53 / 0.67) + pi) % (2 * pi) == pytest.approx(pi, abs=1e-9)


def drive(target: float, seconds: float) -> tuple[float, float, float]:
    """Axis x with its inverter towards a target: position, peak speed, peak acceleration."""
    ppu = Prepositioning(3.0, LIMITS, DT)
    x = v = peak = hardest = 0.0
    for _ in range(round(seconds / DT)):
        command = ppu._command(0, target - x, x + LIMITS.time_constant * v)
        ppu.velocity[0] = command
        a = max(-3.0, min(3.0, (command - v) / LIMITS.time_constant))
        v += a * DT
        x += v * DT
        peak, hardest = max(peak, abs(v)), max(hardest, abs(a))
    return x, peak, hardest


def test_a_far_reference_brings_the_axis_to_its_limit_without_overshoot() -> None:
    x, peak, hardest = drive(50.0, 6.0)
    assert LIMITS.upper[0] - 1e-3 < x <= LIMITS.upper[0] + 1e-6
    assert peak <= LIMITS.velocity + 1e-9
    assert hardest <= LIMITS.acceleration + 1e-9
    x, _, _ = drive(-50.0, 6.0)
    assert x == pytest.approx(LIMITS.lower[0], abs=1e-3)


def test_a_reference_inside_is_reached_exponentially() -> None:
    x, _, _ = drive(0.3, 4.0)
    assert x == pytest.approx(0.3, abs=1e-4)


def test_beyond_its_limit_the_axis_is_only_sent_back() -> None:
    ppu = Prepositioning(3.0, LIMITS, DT)
    outside = np.array([1.65, -1.95])
    for _ in range(1000):
        velocity = ppu.update(np.array([0.0, pi / 2, -0.6, 0.3, 0.9, 0.0]), outside, np.zeros(2))
    assert velocity[0] <= 0.0 <= velocity[1]


def test_the_braking_curve_uses_a_share_of_the_acceleration() -> None:
    ppu = Prepositioning(100.0, LIMITS, DT)
    ppu.velocity[0] = 1.2
    gap = 0.05
    assert ppu._command(0, 10.0, LIMITS.upper[0] - gap) == pytest.approx(
        max(sqrt(2 * 0.7 * 3.0 * gap), 1.2 - 3.0 * DT)
    )


def test_stopping_brakes_at_the_rated_acceleration_to_exact_standstill() -> None:
    ppu = Prepositioning(3.0, LIMITS, DT)
    ppu.velocity = [0.5, -0.2]
    assert ppu.stop() == pytest.approx([0.497, -0.197])
    for _ in range(200):
        ppu.stop()
    assert ppu.velocity == [0.0, 0.0]
