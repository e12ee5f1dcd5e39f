"""An arm in which nothing yields: brakes, sensors, and the same motion as one with stiff springs."""

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.models import Robot
from hapticd.sim.dynamics import DirectArm, SeriesElasticArm
from hapticd.testing.push import push

START = np.array([0.1, -0.785, 0.2, -2.356, 0.1, 1.571, 0.785])
ROTOR = np.array([0.6, 0.6, 0.5, 0.5, 0.2, 0.2, 0.2])
STILL = np.zeros(3)
OPEN, CLOSED = [False] * 7, [True] * 7


def panda() -> Robot:
    return Robot.from_urdf(read_text("panda.urdf"), "panda.urdf")


def arm(brake: float = 0.0) -> DirectArm:
    made = DirectArm(panda(), "handle", ROTOR, np.full(7, brake), 2)
    made.reset(START)
    return made


def test_a_push_moves_it_as_it_moves_an_arm_with_stiff_springs() -> None:
    rigid = arm()
    springs = np.full(7, 2e5), np.full(7, 200.0)
    stiff = SeriesElasticArm(panda(), "handle", ROTOR, *springs, np.zeros(7), 40)
    stiff.reset(START)
    wrench = np.array([10.0, 5.0, -8.0, 0.2, 0.1, 0.3])
    torque = rigid.spring.copy()  # what holds it at rest
    push(rigid.hold, wrench)
    push(stiff.hold, wrench)
    for _ in range(200):
        rigid.step(torque, OPEN, STILL, 1e-3)
        stiff.step(torque, OPEN, STILL, 1e-3)
    np.testing.assert_allclose(rigid.q, stiff.q, atol=2e-3)
    assert np.abs(rigid.q - START).max() > 0.05


def test_closed_brakes_hold_the_weight_or_as_much_as_they_can() -> None:
    held, weak = arm(100.0), arm(5.0)
    for _ in range(100):
        held.step(np.zeros(7), CLOSED, STILL, 1e-3)
        weak.step(np.zeros(7), CLOSED, STILL, 1e-3)
    np.testing.assert_allclose(held.q, START, atol=1e-9)
    assert np.abs(weak.q - START).max() > 1e-2


def test_the_sensor_between_rotor_and_link_feels_the_weight() -> None:
    made = arm(100.0)
    weight = made.spring.copy()
    made.step(np.zeros(7), CLOSED, STILL, 1e-3)
    assert made.spring == pytest.approx(weight, abs=1e-6)
    assert np.abs(weight).max() > 2.0


def test_on_a_base_that_rises_the_sensor_feels_more_than_the_weight_whose_energy_is_the_same() -> None:
    made = arm(200.0)
    weight, energy = made.spring.copy(), made.potential_energy()
    made.step(np.zeros(7), CLOSED, np.array([0.0, 0.0, 9.81]), 1e-3)
    assert made.spring == pytest.approx(2.0 * weight, abs=1e-6)
    assert made.potential_energy() == pytest.approx(energy, abs=1e-9)
