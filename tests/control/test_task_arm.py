"""The arm in the tick against pinocchio, and what the elbow's torque does to the palm."""

import numpy as np
import pinocchio as pin
from hapticd.control.hand_wrench import HandWrench, Load
from hapticd.control.task_arm import Posture, TaskArm
from hapticd.experiments.moved_arm import HOME, panda
from hapticd.sim.tool import SensedTool, Tool


def made(base: np.ndarray | None = None) -> TaskArm:
    return TaskArm(panda(), "handle", np.zeros(7), np.zeros(7), Posture(HOME, 20.0, 3.0), base)


def test_model_terms_are_those_of_pinocchio() -> None:
    arm, robot, rng = made(), panda(), np.random.default_rng(1)
    model, data = robot.model, robot.data
    for _ in range(50):
        arm.q[:], arm.qd[:] = rng.uniform(-1.5, 1.5, 7), rng.standard_normal(7)
        arm.update()
        upper = np.triu(pin.crba(model, data, arm.q))
        np.testing.assert_allclose(arm.M, upper + np.triu(upper, 1).T, atol=1e-10)
        weight = pin.computeGeneralizedGravity(model, data, arm.q)
        np.testing.assert_allclose(arm.weight, weight, atol=1e-9)
        bias = pin.nonLinearEffects(model, data, arm.q, arm.qd)
        np.testing.assert_allclose(arm.coriolis, bias - weight, atol=1e-9)
        np.testing.assert_allclose(arm.twist, arm.palm.J @ arm.qd, atol=1e-12)


def test_the_elbow_goes_home_without_accelerating_the_palm() -> None:
    arm, rng, pulled = made(), np.random.default_rng(2), 0
    for _ in range(200):
        arm.q[:], arm.qd[:] = HOME + rng.uniform(-0.5, 0.5, 7), rng.uniform(-0.5, 0.5, 7)
        arm.update()
        acceleration = arm.palm.J @ np.linalg.solve(arm.M, arm.null)
        np.testing.assert_allclose(acceleration, 0.0, atol=1e-5)
        arm.qd[:] = 0.0
        arm.update()
        pulled += float(arm.null @ np.linalg.solve(arm.M, 20.0 * (HOME - arm.q))) > 0.0
    assert pulled == 200


def test_a_singular_posture_has_finite_torques() -> None:
    arm = made()
    arm.q[:] = 0.0
    arm.update()
    assert np.isfinite(arm.null).all()


def test_a_base_that_leans_moves_palm_and_gravity() -> None:
    base = pin.SE3(pin.exp3(np.array([0.3, -0.4, 1.0])), np.array([0.1, 0.4, 1.1]))
    arm, upright, robot = made(base.homogeneous), made(), panda()
    for each in (arm, upright):
        each.q[:] = HOME
        each.update()
    np.testing.assert_allclose(arm.palm.position, base.act(upright.palm.position), atol=1e-12)
    np.testing.assert_allclose(arm.palm.rotation, base.rotation @ upright.palm.rotation, atol=1e-12)
    robot.model.gravity.linear = base.rotation.T @ np.array([0.0, 0.0, -9.81])
    weight = pin.computeGeneralizedGravity(robot.model, robot.data, HOME)
    np.testing.assert_allclose(arm.weight, weight, atol=1e-9)


class Carrier:
    rotation, twist, acceleration = np.eye(3), np.zeros(6), np.zeros(6)


def test_the_wrench_at_the_palm_is_what_the_hand_does() -> None:
    """Judged by the simulated sensor, which adds the weight by its own equations, and by pinocchio."""
    rng = np.random.default_rng(3)
    T = pin.SE3(pin.exp3(np.array([0.4, 0.2, -0.7])), np.array([0.02, -0.03, 0.11]))
    carrier, pushed, measured = Carrier(), np.zeros(6), np.zeros(6)
    tool = Tool(0.8, (0.01, -0.02, 0.05), (0.0, 0.0, 0.0))
    place = T.rotation.T @ T.translation
    sensed = SensedTool(tool, place.tolist(), carrier, pushed, T.rotation)
    sensed.base[:] = 0.0, 0.0, 9.81
    bias = rng.standard_normal(6)
    hand = HandWrench(Load(bias, tool.mass, np.array(tool.centre)), T.homogeneous, carrier.rotation, measured)
    for _ in range(20):
        carrier.rotation[:] = pin.exp3(rng.standard_normal(3))
        pushed[:] = rng.standard_normal(6)
        sensed.update()
        measured[:] = sensed.felt + bias
        hand.update()
        inside = pin.SE3(carrier.rotation.T, np.zeros(3)).act(pin.Force(pushed)).vector
        np.testing.assert_allclose(hand.wrench, inside, atol=1e-12)
