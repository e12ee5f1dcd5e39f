"""Gains against the Riccati recursion, transitions against fine steps; noise and delay of the estimates."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.control.joint_kalman import JointKalman, exponential, model, steady_state

DT = 1e-3
ROTOR, STIFFNESS, INERTIA, TORQUE = 1.5, 15e3, 12.0, 260.0


def test_the_gain_is_what_the_recursion_comes_to() -> None:
    A, _, H = model(ROTOR, STIFFNESS, INERTIA, DT)
    Q, R = np.diag([1e-12, 1e-9, 1e-12, 1e-9, 1e-2, 1e-3, 1e-2]), np.diag([1e-10, 4e-6, 1e-10, 1e-2])
    K, P = steady_state(A, H, Q, R)
    step = np.eye(7)
    for _ in range(20_000):
        gain = step @ H.T @ np.linalg.inv(H @ step @ H.T + R)
        step = A @ (step - gain @ H @ step) @ A.T + Q
    np.testing.assert_allclose(P, step, rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(K, gain, rtol=1e-5, atol=1e-8)
    assert np.abs(np.linalg.eigvals((np.eye(7) - K @ H) @ A)).max() < 1.0


def test_what_no_sensor_sees_has_no_steady_state() -> None:
    with pytest.raises(ValueError, match="not seen"):
        steady_state(np.diag([1.0, 1.0]), np.array([[1.0, 0.0]]), np.eye(2), np.eye(1))


def test_a_transition_is_many_fine_steps_of_the_equations() -> None:
    A, B, _ = model(ROTOR, STIFFNESS, INERTIA, DT)
    x = start = np.array([0.01, 0.3, 0.004, -0.2, 1.0, -2.0, 0.7])
    n = 20_000
    for _ in range(n):
        spring = STIFFNESS * (x[0] - x[2])
        rate = np.array([x[1], (40.0 - spring) / ROTOR + x[4], x[3], spring / INERTIA + x[5], 0.0, 0.0, 0.0])
        x = x + DT / n * rate
    np.testing.assert_allclose(A @ start + 40.0 * B, x, atol=1e-5)
    np.testing.assert_allclose(
        exponential(np.array([[0.0, -2.0], [2.0, 0.0]]))[0, 0], np.cos(2.0), atol=1e-14
    )


def test_noise_falls_without_delay_though_spring_and_load_are_others() -> None:
    """A joint that swings at 1 Hz on a spring that is 5 % softer, with friction, its load sensor off."""
    rng, seconds, stiffness = np.random.default_rng(3), 6.0, 0.95 * STIFFNESS
    t, w = DT * np.arange(round(seconds / DT)), 2.0 * np.pi
    link, link_rate, link_fast = 0.3 * np.sin(w * t), 0.3 * w * np.cos(w * t), -0.3 * w * w * np.sin(w * t)
    load = 1.3 * INERTIA * link_fast + 20.0
    motor = link + load / stiffness
    rate = link_rate - w * w * link_rate * 1.3 * INERTIA / stiffness
    fast = link_fast - w * w * link_fast * 1.3 * INERTIA / stiffness
    told = ROTOR * fast + load + 5.0 * np.sign(rate)
    noise = rng.standard_normal((4, len(t))) * np.array([1e-5, 2e-3, 1e-5, 0.1])[:, None]
    seen = np.array([motor + 2e-4, rate, link, load + 2.0]) + noise
    measured = tuple(np.zeros(1) for _ in range(4))
    one = [np.array([x]) for x in (ROTOR, STIFFNESS, INERTIA, TORQUE, 25.0)]
    kalman, found = JointKalman(*one, measured, DT), np.zeros((len(t), 3))  # type: ignore[arg-type]
    for k in range(len(t)):
        for array, value in zip(measured, seen[:, k], strict=True):
            array[0] = value
        if k:
            kalman.update(told[k - 1 : k])
        else:
            kalman.reset()
        found[k] = kalman.motor_rate[0], kalman.link_rate[0], kalman.link_acceleration[0]
    late = slice(3000, None)
    off = found[late] - np.column_stack([rate, link_rate, link_fast])[late]
    plain = np.diff(seen[2])[2999:] / DT - link_rate[late]
    assert off[:, 0].std() < 0.85 * 2e-3
    assert off[:, 1].std() < 0.25 * plain.std()
    assert off[:, 2].std() < 0.05 * np.abs(link_fast).max()
