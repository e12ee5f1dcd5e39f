"""What pushes an arm beside the hand, judged by what pushes the plant; and how a joint gives way to it."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.control.compliance import RESPONSE_S, WARY, Compliance
from hapticd.control.external_torque import ExternalTorque
from hapticd.control.serial import SerialChain
from hapticd.models import Robot
from hapticd.sim.dynamics import SeriesElasticArm
from hapticd.testing.push import push

ROTOR = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15])
STIFFNESS = np.array([15e3, 15e3, 8e3, 8e3, 2.5e3, 2.5e3])
START = np.array([0.2, 1.4, -0.7, 0.5, 0.7, 0.1])
DT = 1e-3


def estimated(pushed: np.ndarray, wrench: np.ndarray, told: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Estimates of the last half second, (k, 6), while motors swing an arm; and how fast its joints were."""
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    arm = SeriesElasticArm(
        robot, "handle", ROTOR, STIFFNESS, np.array([20, 20, 10, 10, 2, 2.0]), np.full(6, 300.0), 4
    )
    arm.reset(START)
    chain = SerialChain(robot, ["handle"])
    chain.bind(arm.q, arm.qd)
    external = ExternalTorque(robot, chain, arm.q, arm.spring, chain.frames[0].J, DT)
    held = arm.spring.copy()
    found, speeds = [], []
    for k in range(1500):
        swing = np.sin(2.0 * np.pi * np.array([0.5, 0.7, 0.9, 0.6, 0.8, 1.1]) * k * DT)
        lead = START + 0.3 * swing + held / STIFFNESS
        motor = held + 3e3 * ROTOR * (lead - arm.motor) - 80.0 * ROTOR * arm.motor_rate
        arm.push[:] = pushed if k > 500 else 0.0
        push(arm.hold, wrench)
        arm.step(motor, [False] * 6, np.array([0.4, -0.3, 0.0]), DT)
        chain.update()
        torque = external.update(wrench if told else np.zeros(6), np.array([0.4, -0.3]))
        found.append(torque.copy())
        speeds.append(np.abs(arm.qd))
    return np.array(found)[1000:], np.array(speeds).max(axis=0)


def test_what_pushes_the_links_is_told_from_their_motion_and_from_the_hand() -> None:
    pushed, wrench = np.array([60.0, -40.0, 15.0, -10.0, 4.0, 3.0]), np.array([20.0, -30, 25, 1, -2, 1.5])
    found, speeds = estimated(pushed, wrench)
    assert speeds.min() > 0.3
    np.testing.assert_allclose(found.mean(axis=0), pushed, atol=0.3)
    assert np.abs(found - pushed).max() < 3.0
    alone, _ = estimated(np.zeros(6), wrench)
    assert np.abs(alone).max() < 3.0
    untold, _ = estimated(np.zeros(6), wrench, told=False)
    assert np.abs(untold).max() > 20.0


THRESHOLD, YIELDING, RELAX = 10.0, 1e-3, 0.1


def joint() -> Compliance:
    one = np.ones(1)
    return Compliance(THRESHOLD * one, YIELDING * one, 2.0 * one, 30.0 * one, RELAX)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("size", "speed"),
    [
        (0.0, -np.inf),
        (0.99 * WARY * THRESHOLD, -np.inf),
        (1.000001 * WARY * THRESHOLD, -2.0),
        (0.5 * (1.0 + WARY) * THRESHOLD, -1.0),
        (THRESHOLD, 0.0),
        (THRESHOLD + 20.0, 20.0 * YIELDING / RELAX),
    ],
)
def test_the_least_speed_along_a_push_rises_with_it(size: float, speed: float, sign: float) -> None:
    compliance, qd = joint(), np.array([0.1])
    compliance.update(np.array([sign * size]), sign * qd)
    least = compliance.least[0] if sign > 0.0 else -compliance.most[0]
    other = compliance.most[0] if sign > 0.0 else -compliance.least[0]
    assert least == pytest.approx((speed - qd[0]) / RESPONSE_S, rel=1e-4, abs=1e-6)
    assert other == np.inf
    assert compliance.excess[0] == pytest.approx(sign * max(size - THRESHOLD, 0.0))


def test_it_asks_for_no_more_than_a_joint_is_rated_for() -> None:
    compliance = joint()
    compliance.update(np.array([1e4]), np.array([-1.0]))
    assert compliance.least[0] == 30.0


def test_a_blocked_link_is_relieved_within_the_time_it_should() -> None:
    compliance, q, qd = joint(), 0.0, np.zeros(1)
    beyond = []
    for _ in range(300):
        compliance.update(np.array([THRESHOLD + 40.0 - q / YIELDING]), qd)
        beyond.append(compliance.excess[0])
        qd += DT * compliance.least
        q += DT * qd[0]
    # a response of 20 ms beside a decay of 100 ms: a second-order system with that sum of time constants
    t = np.arange(300) * DT
    fast, slow = np.sort(np.roots([RESPONSE_S * RELAX, RELAX, 1.0]).real)
    truth = 40.0 * (fast * np.exp(slow * t) - slow * np.exp(fast * t)) / (fast - slow)
    np.testing.assert_allclose(beyond, truth, atol=0.5)
    assert beyond[-1] < 3.0
