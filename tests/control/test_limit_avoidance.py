"""Limit avoidance against the paper's equations, written out."""

import numpy as np
import pytest
from hapticd.control.limit_avoidance import (
    LOWER,
    SPEED,
    UPPER,
    Avoidance,
    JointLimits,
    LimitAvoidance,
    slowed,
)

LIMITS = JointLimits(np.array([-2.9, -1.7]), np.array([2.9, 1.7]), np.array([2.2, 2.6]))
P, V = Avoidance(3.0, np.radians(10), np.radians(0.5)), Avoidance(2.0, np.radians(40), np.radians(2))


def made() -> tuple[LimitAvoidance, np.ndarray, np.ndarray]:
    q, qd = np.zeros(2), np.zeros(2)
    return LimitAvoidance(LIMITS, q, qd, P, V), q, qd


def by_hand(q: float, qd: float, i: int) -> tuple[float, float]:
    """(3) to (5) with the closer limit, and a sign."""
    lower, upper, fastest = LIMITS.lower[i], LIMITS.upper[i], LIMITS.velocity[i]
    d = min(q - lower, upper - q)
    spare = fastest - abs(qd)
    away = 1.0 if q - lower < upper - q else -1.0
    tau = away * 3.0 * (1 / max(d, np.radians(0.5)) - 1 / P.zone) if d < P.zone else 0.0
    if spare < V.zone:
        tau -= np.sign(qd) * 2.0 * (1 / max(spare, np.radians(2)) - 1 / V.zone)
    return tau, min(1.0, max(0.0, 2.0 * min(d / P.zone, spare / V.zone) - 1.0))


def test_torque_and_alpha_are_those_of_the_paper() -> None:
    avoidance, q, qd = made()
    rng = np.random.default_rng(1)
    for _ in range(2000):
        q[:] = rng.uniform(-1.1, 1.1, 2) * LIMITS.upper
        qd[:] = rng.uniform(-1.1, 1.1, 2) * LIMITS.velocity
        avoidance.update()
        for i in range(2):
            tau, alpha = by_hand(float(q[i]), float(qd[i]), i)
            assert avoidance.torque[i] == pytest.approx(tau, abs=1e-12)
            assert avoidance.alpha[i] == pytest.approx(alpha, abs=1e-12)
            assert abs(avoidance.torque[i]) <= P.most + V.most + 1e-9


def test_it_says_which_limit_pushes() -> None:
    avoidance, q, qd = made()
    q[:], qd[:] = [-2.85, 1.65], [0.0, 2.5]
    avoidance.update()
    assert avoidance.near.tolist() == [LOWER, UPPER | SPEED]
    q[:], qd[:] = 0.0, 0.0
    avoidance.update()
    assert not avoidance.near.any() and not avoidance.torque.any() and (avoidance.alpha == 1.0).all()


def test_constants_that_make_no_sense_are_refused() -> None:
    for bad in ((-1.0, 0.1, 0.01), (1.0, 0.1, 0.2), (1.0, 0.1, 0.0)):
        with pytest.raises(ValueError, match="0 < least < zone"):
            Avoidance(*bad)


def test_near_its_largest_speed_a_command_drives_a_joint_on_ever_less_and_brakes_as_it_likes() -> None:
    velocity = [2.0, 2.5]
    for speed, share in ((0.0, 1.0), (1.7, 1.0), (1.85, 0.5), (2.0, 0.0), (2.3, 0.0)):
        for side in (-1.0, 1.0):
            on, back = np.array([8.0 * side, 1.0]), np.array([-8.0 * side, 1.0])
            slowed(on, np.array([side * speed, -1.0]), velocity, 0.3)
            slowed(back, np.array([side * speed, -1.0]), velocity, 0.3)
            np.testing.assert_allclose(on, [share * 8.0 * side, 1.0], atol=1e-9)
            assert back.tolist() == [-8.0 * side, 1.0]
