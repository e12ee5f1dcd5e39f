"""Tracking torques against the rigid-body equations, and on a series-elastic arm."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.control.ability import Ability
from hapticd.control.serial import SerialChain
from hapticd.control.tracking import Admitted, SeriesElasticity, Tracking
from hapticd.models import Robot
from hapticd.sim.dynamics import SeriesElasticArm
from hapticd.testing.push import push

DT = 1e-3
ROTOR = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15])
STIFFNESS = np.array([15e3, 15e3, 8e3, 8e3, 2.5e3, 2.5e3])
P, D = np.array([6000, 6000, 2500, 2500, 500, 500.0]), np.array([180, 180, 75, 75, 15, 15.0])

ADMITTED = Admitted(*(np.full(6, most) for most in (100.0, 250.0, -2.0, 2.0)))


@pytest.fixture
def robot() -> Robot:
    return Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])


def track(robot: Robot, state: dict[str, np.ndarray]) -> Tracking:
    elasticity = SeriesElasticity(ROTOR, STIFFNESS)
    return Tracking(robot, SerialChain(robot, []), elasticity, P, D, ADMITTED, Ability(6), state, DT)


def inputs() -> dict[str, np.ndarray]:
    vectors = {name: np.zeros(6) for name in ("q", "qd", "qdd", "wrench", "motor", "motor_rate", "link")}
    return vectors | {"J": np.zeros((6, 6))}


def test_feedforward_is_gravity_inertia_friction_and_wrench_and_the_rotor(robot: Robot) -> None:
    rng = np.random.default_rng(8)
    state = inputs()
    tracking = track(robot, state)
    model = robot.model.copy()
    data = model.createData()
    for _ in range(20):
        tracking.reset()
        for name in ("q", "qd", "qdd", "wrench"):
            state[name][:] = rng.standard_normal(6)
        base = rng.standard_normal(2)
        model.gravity.linear = np.array([-base[0], -base[1], -9.81])
        qp = robot.configuration(state["q"]).copy()
        state["J"][:] = pin.computeFrameJacobian(
            model, data, qp, model.getFrameId("handle"), pin.LOCAL_WORLD_ALIGNED
        )
        M, h = pin.crba(model, data, qp).copy(), pin.nonLinearEffects(model, data, qp, state["qd"]).copy()
        M = np.triu(M) + np.triu(M, 1).T
        spring = M @ state["qdd"] + h + robot.damping * state["qd"] - state["J"].T @ state["wrench"]
        # a motor exactly on its reference leaves the feedforward alone
        state["motor"][:], state["motor_rate"][:] = state["q"] + spring / STIFFNESS, state["qd"]
        torque = tracking.update(base)
        np.testing.assert_allclose(torque, spring + ROTOR * state["qdd"], rtol=1e-9, atol=1e-9)


def test_the_measured_motor_is_compared_with_the_reference_of_its_own_tick(robot: Robot) -> None:
    state = inputs()
    tracking = track(robot, state)
    state["qd"][:] = 0.5
    state["motor_rate"][:] = 0.5
    tracking.update(np.zeros(2))
    reference = state["q"] + (tracking._rigid + robot.damping * state["qd"]) / STIFFNESS
    state["q"] += 0.5 * DT
    state["motor"][:] = reference  # where the motor should have been one tick ago
    torque = tracking.update(np.zeros(2)).copy()
    feedforward = tracking._rigid + robot.damping * state["qd"]
    np.testing.assert_allclose(torque, feedforward, atol=1e-9)


def follow(robot: Robot, frequency: float, swing: float) -> float:
    """How far the links are from a reference that swings, at most, under a push [rad]."""
    plant_model = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    damping, brake = np.array([20, 20, 10, 10, 2, 2.0]), np.full(6, 300.0)
    arm = SeriesElasticArm(plant_model, "handle", ROTOR, STIFFNESS, damping, brake, 4)
    start = np.array([0.2, 1.4, -0.7, 0.5, 0.7, 0.1])
    arm.reset(start)
    state = inputs()
    tracking = track(robot, state)
    wrench = np.array([20.0, -10.0, 15.0, 0.5, 1.0, -0.3])
    state["motor"][:], state["motor_rate"][:] = arm.motor, arm.motor_rate
    worst = 0.0
    for k in range(2000):
        t, w = k * DT, 2.0 * np.pi * frequency
        state["q"][:] = start + swing * (1 - np.cos(w * t))
        state["qd"][:] = swing * w * np.sin(w * t)
        state["qdd"][:] = swing * w * w * np.cos(w * t)
        state["wrench"][:] = wrench * min(1.0, t)
        qp = robot.configuration(state["q"])
        pin.computeJointJacobians(robot.model, robot.data, qp)
        pin.updateFramePlacements(robot.model, robot.data)
        state["J"][:] = pin.getFrameJacobian(
            robot.model, robot.data, robot.frame("handle"), pin.LOCAL_WORLD_ALIGNED
        )
        tracking.forecast(np.zeros(2))
        torque = tracking.update(np.zeros(2))
        state["motor"][:], state["motor_rate"][:] = arm.motor, arm.motor_rate
        worst = max(worst, float(np.abs(arm.q - state["q"]).max())) if k > 300 else 0.0
        push(arm.hold, state["wrench"])
        arm.step(torque.copy(), [False] * 6, np.zeros(3), DT)
    return worst


def test_a_series_elastic_arm_follows_a_moving_reference_under_a_push(robot: Robot) -> None:
    assert follow(robot, 0.3, 0.3) < 1e-3
