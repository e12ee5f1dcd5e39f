"""The operator's law on plants that are not what it believes."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.limit_avoidance import VELOCITY, Avoidance
from hapticd.control.task_arm import Posture
from hapticd.experiments.moved_arm import HOME, Doubt, Grip, MovedArm, panda, panda_doubt
from hapticd.models import Array, Robot
from hapticd.sim.tool import Tool


def test_the_torque_is_the_sum_of_the_paper() -> None:
    moved = MovedArm(panda(), panda_doubt(1), Posture(HOME), Grip(), assist=1.5)
    rng = np.random.default_rng(1)
    moved.q[:], moved.qd[:] = HOME, rng.standard_normal(7)
    moved.q[3] = -0.15  # next to its limit
    moved.arm.update()
    moved.avoidance.update()
    for wrench in (moved.hand.wrench, moved.felt, moved.limits):
        wrench[:] = rng.standard_normal(6)
    moved.law.update()
    robot, palm = panda(), moved.arm.palm
    J = pin.computeFrameJacobian(robot.model, robot.data, moved.q, robot.frame("handle"), pin.LOCAL)
    alpha, null, coriolis = moved.avoidance.alpha, moved.arm.null, moved.arm.coriolis
    assert alpha[3] < 0.1 < alpha[0] and palm.J.shape == (6, 7)
    expected = alpha * 1.5 * (J.T @ moved.hand.wrench) + J.T @ (moved.felt + moved.limits)
    np.testing.assert_allclose(
        moved.law.torque, expected + moved.avoidance.torque + null + coriolis, atol=1e-9
    )


def rms_force(seed: int, assisted: bool) -> float:
    moved = MovedArm(panda(), panda_doubt(seed), Posture(HOME), Grip())
    moved.reset(HOME)
    forces = []
    for k in range(2500):
        t = 1e-3 * k
        way = np.array([0.08, 0.12, 0.1]) * np.array([1.0, 0.0, 1.0]) + [0.0, 0.05, 0.0]
        w = 2 * np.pi * 0.5
        moved.step(moved.home + way * np.sin(w * t), way * w * np.cos(w * t), assisted)
        forces.append(moved.plant.hold.wrench[:3].copy())
    return float(np.sqrt(np.mean(np.square(forces[500:]))))


def test_the_arm_is_moved_with_less_force_than_under_gravity_compensation_alone() -> None:
    assert rms_force(2, True) <= 0.65 * rms_force(2, False)


def lever() -> Robot:
    """One joint: inertia .8 kg m^2, held at .5 m from its axis."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "joint")
    model.appendBodyToJoint(
        joint, pin.Inertia(1e-6, np.zeros(3), np.diag([1.0, 1.0, 0.8])), pin.SE3.Identity()
    )
    grip = pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0]))
    model.addFrame(pin.Frame("grip", joint, 0, grip, pin.FrameType.OP_FRAME))
    model.lowerPositionLimit, model.upperPositionLimit = np.array([-1.5]), np.array([1.5])
    model.velocityLimit = np.array([2.175])
    return Robot(model)


def swing(alpha: bool) -> float:
    """Degrees from one end to the other of what is left after a hand has pressed into the limit for 6 s."""
    beta = Avoidance(3.0, np.radians(10), np.radians(0.5))
    moved = MovedArm(
        lever(),
        Doubt(np.ones(1), np.zeros(1), delay=4),
        Posture(np.zeros(1), 0.0, 0.0),
        Grip((1000.0, 1e-3), (20.0, 1e-3)),
        "grip",
        2.0,
        beta,
        VELOCITY,
        alpha,
        Tool(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    )
    moved.reset(np.zeros(1))
    angles = []
    for k in range(8000):
        goal = min(1.6, 0.7e-3 * k)
        wanted = 0.5 * np.array([np.cos(goal), np.sin(goal), 0.0])
        rate: Array = np.array([-np.sin(goal), np.cos(goal), 0.0]) * (0.35 if goal < 1.6 else 0.0)
        moved.step(wanted, rate)
        angles.append(float(moved.plant.q[0]))
    return float(np.degrees(np.ptp(angles[-1500:])))


@pytest.mark.parametrize("alpha", [True, False])
def test_alpha_ends_the_oscillation_at_a_limit(alpha: bool) -> None:
    if alpha:
        assert swing(True) < 0.05
    else:
        assert swing(False) > 1.0
