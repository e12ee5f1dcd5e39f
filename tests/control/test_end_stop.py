"""The end stop of joints: passive, one-sided, and stronger than what pushes."""

import numpy as np
import pytest
from hapticd.control.end_stop import EndStop

LOWER, UPPER = np.array([-1.0, 0.2]), np.array([1.0, 0.9])


def stop() -> EndStop:
    stiffness, damping, deceleration = np.array([[2000.0, 300.0], [60.0, 5.0], [10.0, 20.0]])
    return EndStop(LOWER, UPPER, stiffness, damping, deceleration, 0.02)


def test_nothing_acts_between_the_ends_nor_after_leaving_one() -> None:
    made = stop()
    assert not made.update(np.array([0.2, 0.5]), np.array([3.0, -3.0])).any()
    assert made.update(np.array([0.99, 0.5]), np.zeros(2))[0] < 0.0
    assert not made.update(np.array([0.97, 0.5]), np.zeros(2)).any()


def test_at_both_ends_the_spring_pushes_back_and_only_going_on_is_damped() -> None:
    made = stop()
    np.testing.assert_allclose(made.update(np.array([1.01, 0.21]), np.array([0.1, -0.1])), [-66.0, 3.5])
    np.testing.assert_allclose(made.update(np.array([1.01, 0.21]), np.array([-0.1, 0.1])), [-60.0, 3.0])


def test_a_joint_that_comes_fast_and_is_pushed_on_rests_where_the_spring_holds_it() -> None:
    """1 kg m^2, 40 N m, 1 rad/s: at 40/2000 rad past where the stop begins, and energy only falls there."""
    made = stop()
    q, qd, dt = np.array([0.9, 0.5]), np.array([1.0, 0.0]), 1e-3
    most = 0.0
    for _ in range(3000):
        qd[0] += dt * (40.0 + made.update(q, qd)[0])
        q[0] += dt * qd[0]
        most = max(most, q[0])
    assert abs(q[0] - (0.98 + 40.0 / 2000.0)) < 1e-6 and most < 1.03


def test_a_command_drives_a_joint_on_ever_less_and_back_as_it_likes() -> None:
    made = stop()
    places = [(0.97, 1.0), (0.98, 1.0), (0.985, 0.75), (0.995, 0.25), (1.0, 0.0), (1.1, 0.0)]
    for x, share in places:
        for q, outwards in ((x, 8.0), (-x, -8.0)):
            torque = np.array([outwards, 1.0])
            made.restrain(np.array([q, 0.5]), torque)
            np.testing.assert_allclose(torque, [share * outwards, 1.0], atol=1e-9)
            back = np.array([-outwards, 1.0])
            made.restrain(np.array([q, 0.5]), back)
            assert back.tolist() == [-outwards, 1.0]


@pytest.mark.parametrize("seed", range(20))
def test_no_command_however_strong_takes_a_joint_through_its_limit(seed: int) -> None:
    """One that grows, as of a palm that is led ever further than its arm reaches."""
    random = np.random.default_rng(seed)
    made, inertia, growth = stop(), random.uniform(0.02, 1.0), random.uniform(5.0, 500.0)
    q, qd, dt = np.array([0.97, 0.5]), np.zeros(2), 5e-4
    for tick in range(8000):
        torque = np.array([growth * tick * dt, 0.0])
        made.restrain(q, torque)
        torque += made.update(q, qd) - 2.0 * qd
        qd[0] += dt * torque[0] / inertia
        q[0] += dt * qd[0]
        assert q[0] < 1.0


@pytest.mark.parametrize("seed", range(20))
def test_a_joint_however_fast_is_braked_before_its_end_and_gets_no_energy(seed: int) -> None:
    random = np.random.default_rng(seed)
    made, inertia, dt = stop(), random.uniform(0.5, 2.5), 1e-3
    side = random.choice([-1.0, 1.0])
    q, qd = np.array([0.0, 0.5]), np.array([side * random.uniform(0.5, 4.0), 0.0])
    for _ in range(4000):
        torque = made.update(q, qd)
        if abs(q[0]) < 0.98:
            assert torque[0] * qd[0] <= 0.0
        qd[0] += dt * torque[0] / inertia
        q[0] += dt * qd[0]
        assert abs(q[0]) < 1.0
    assert abs(qd[0]) < 0.6


def test_the_brake_is_what_a_stop_from_that_speed_needs() -> None:
    """10 rad/s^2: from .18 m before where the spring begins 1.9 rad/s are as fast as may be."""
    made = stop()
    assert not made.update(np.array([0.80, 0.5]), np.array([1.89, 0.0])).any()
    fast = np.sqrt(2 * 10.0 * 0.18)
    np.testing.assert_allclose(made.update(np.array([0.80, 0.5]), np.array([fast + 0.5, 0.0]))[0], -30.0)
    assert not made.update(np.array([0.80, 0.5]), np.array([-fast - 0.5, 0.0])).any()
