"""The hold brakes and holds; it never pushes on what is slower than planned."""

import numpy as np
import pytest
from hapticd.control.hold import Hold, HoldGains

DT = 1e-3
GAINS = HoldGains(np.array([300.0]), np.array([12.0]), np.array([100.0]), np.array([9.0]))


def hold(speed: float) -> Hold:
    made = Hold(GAINS, DT)
    made.reset(np.array([0.3]), np.array([speed]))
    return made


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_a_joint_is_brought_to_rest_at_its_rated_deceleration_and_held_there(speed: float) -> None:
    made, q, qd, inertia = hold(speed), 0.3, speed, 0.05
    for _ in range(200):
        torque = made.update(np.array([q]), np.array([qd]))[0]
        qd += DT * torque / inertia
        q += DT * qd
    assert made.at_rest
    assert abs(qd) < 2e-3
    assert q - 0.3 == pytest.approx(np.sign(speed) * speed**2 / 200.0, abs=2e-3)


@pytest.mark.parametrize("speed", [12.0, -12.0])
@pytest.mark.parametrize("friction", [3.0, 20.0])
def test_a_joint_that_is_braked_harder_than_planned_is_not_pushed_on(speed: float, friction: float) -> None:
    made, q, qd, inertia, work = hold(speed), 0.3, speed, 0.05, 0.0
    for _ in range(400):
        torque = made.update(np.array([q]), np.array([qd]))[0]
        work += DT * max(0.0, torque * qd) * (not made.at_rest)
        dry = min(friction * DT / inertia, abs(qd + DT * torque / inertia))
        qd += DT * torque / inertia
        qd -= np.sign(qd) * dry
        q += DT * qd
    assert made.at_rest
    assert work < 1e-2  # of 3.6 J
