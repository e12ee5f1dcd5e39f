"""The hold brakes and holds; it never pushes on what is slower than planned."""

import numpy as np
import pytest
from hapticd.control.hold import Hold, HoldGains, bearable

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


@pytest.mark.parametrize("seed", range(10))
def test_what_a_braking_motor_withstood_does_not_drive_its_joint_on(seed: int) -> None:
    """A load as large as what the motor can, which had braked it; without that torque it had sped up."""
    random = np.random.default_rng(seed)
    side, speed, inertia = random.choice([-1.0, 1.0]), random.uniform(1.5, 3.0), random.uniform(0.05, 0.5)
    fastest = {}
    for told in (False, True):
        made, q, qd = Hold(GAINS, DT), 0.3, side * speed
        made.reset(np.array([q]), np.array([qd]), np.array([-9.0 * side]) if told else None)
        fastest[told] = speed
        for _ in range(100):
            qd += DT * (made.update(np.array([q]), np.array([qd]))[0] + 9.0 * side) / inertia
            q += DT * qd
            fastest[told] = max(fastest[told], abs(qd))
    assert fastest[True] < speed + 0.01 < fastest[False]


def test_what_drove_a_joint_on_or_held_one_that_stood_is_no_damper() -> None:
    made = Hold(GAINS, DT)
    for torque, qd in ((9.0, 2.0), (-9.0, -2.0), (-9.0, 0.5), (9.0, 0.0)):
        made.reset(np.array([0.3]), np.array([qd]), np.array([torque]))
        plain = hold(qd)
        assert made.update(np.array([0.3]), np.array([qd])) == plain.update(np.array([0.3]), np.array([qd]))
    made.reset(np.array([0.3]), np.array([2.0]), np.array([-5.0]))
    assert made.update(np.array([0.3]), np.array([2.0]))[0] == -5.0
    made.reset(np.array([0.3]), np.array([2.0]))
    assert made.update(np.array([0.3]), np.array([2.0]))[0] == 0.0


def test_a_command_is_scaled_as_little_as_its_weakest_motor_allows() -> None:
    random = np.random.default_rng(5)
    whole = 0
    for _ in range(1000):
        most = random.uniform(5.0, 90.0, 7)
        other = random.uniform(-1.1, 1.1, 7) * most
        asked = random.normal(0.0, 20.0, 7)
        torque = asked.copy()
        bearable(torque, other, most)
        room = most - np.sign(asked) * other
        share = np.clip(room / np.abs(asked), 0.0, 1.0).min()
        np.testing.assert_allclose(torque, share * asked, atol=1e-12)
        # no motor is driven beyond what it has, but by what it gives besides
        assert (np.abs(other + torque) <= np.maximum(most, np.abs(other)) + 1e-12).all()
        whole += share == 1.0
    assert 20 < whole < 900
