"""The rigid plant: energy, a closed form, brakes; and the finger that palpates."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.configs.quantities import HandStiffness
from hapticd.machines.rhi import planar
from hapticd.models import Robot
from hapticd.sim.hand import Path, PointHand
from hapticd.sim.links import SimulationError
from hapticd.sim.rigid import RigidArm

FREE = [False] * 4


def arm(friction: float = 0.0, brake: float = 5.0) -> RigidArm:
    robot = Robot.from_urdf(planar.urdf("rhi", planar.FOUR_DOF), "rhi.urdf")
    rotor = np.array([0.0132, 0.0181, 0.0025, 0.0035])
    made = RigidArm(
        robot, planar.HANDLE, planar.FOUR_DOF_TRANSMISSION, rotor, np.full(4, friction), np.full(4, brake)
    )
    made.reset(np.array([0.3, 0.8, -0.2, 1.0]))
    return made


def test_energy_is_kept_without_friction_and_lost_with_it() -> None:
    for friction, kept in ((0.0, True), (0.05, False)):
        plant = arm(friction)
        plant.qd[:] = 2.0, -1.0, 1.5, -2.0
        plant.step(np.zeros(4), FREE, [0.0] * 3, 0.0)
        before = plant.energy()
        for _ in range(5000):
            plant.step(np.zeros(4), FREE, [0.0] * 3, 1e-4)
        if kept:
            assert plant.energy() == pytest.approx(before, rel=2e-3)
        else:
            assert plant.energy() < 0.1 * before


def test_the_work_of_torque_and_force_is_the_gain_in_energy() -> None:
    plant, work, h = arm(), 0.0, 1e-4
    torque, force = np.array([0.02, -0.01, 0.01, 0.005]), [0.1, -0.2, 0.0]
    for _ in range(3000):
        plant.step(torque, FREE, force, h)
        work += h * float(torque @ plant.qd + np.dot(force, plant.velocity))
    assert plant.energy() == pytest.approx(work, rel=5e-3)


def test_accelerations_and_the_frame_are_those_of_pinocchio() -> None:
    rng = np.random.default_rng(3)
    robot = Robot.from_urdf(read_text("panda.urdf"), "panda.urdf")
    frame, model, data, n = "handle", robot.model, robot.data, robot.nv
    for _ in range(20):
        T, rotor, friction = np.eye(n) + 0.3 * rng.normal(size=(n, n)), *rng.uniform(0.01, 0.5, (2, n))
        plant = RigidArm(robot, frame, T, rotor, friction, np.ones(n), rows=6)
        plant.q[:], plant.qd[:] = rng.uniform(-1.0, 1.0, (2, n))
        torque, force = rng.normal(size=n), rng.normal(size=3)
        plant.step(torque, [False] * n, [0.0] * 3, 0.0)  # to that state
        plant.step(torque, [False] * n, force.tolist(), 0.0)
        q, qd = T @ plant.q, T @ plant.qd
        J = pin.computeFrameJacobian(model, data, q, robot.frame(frame), pin.LOCAL_WORLD_ALIGNED) @ T
        upper = np.triu(pin.crba(model, data, q))
        M = T.T @ (upper + np.triu(upper, 1).T) @ T + np.diag(rotor)
        driven = (
            torque - friction * plant.qd - T.T @ pin.nonLinearEffects(model, data, q, qd) + J[:3].T @ force
        )
        np.testing.assert_allclose(M @ plant.qdd, driven, atol=1e-10)
        np.testing.assert_allclose(plant.twist, J @ plant.qd, atol=1e-12)
        np.testing.assert_allclose(plant.velocity, plant.twist[:3], atol=0.0)
        pin.framesForwardKinematics(model, data, q)
        pose = data.oMf[robot.frame(frame)]
        np.testing.assert_allclose(plant.position, pose.translation, atol=1e-13)
        np.testing.assert_allclose(plant.rotation, pose.rotation, atol=1e-13)
        assert plant.energy() == pytest.approx(0.5 * plant.qd @ M @ plant.qd, rel=1e-12)


def test_a_state_that_is_none_is_told() -> None:
    plant = arm()
    with pytest.raises(SimulationError, match="not anywhere"):
        plant.step(np.full(4, np.nan), FREE, [0.0] * 3, 1e-4)


def test_velocity_is_the_derivative_of_position() -> None:
    plant = arm()
    plant.qd[:] = 1.0, -0.5, 2.0, 0.5
    plant.step(np.zeros(4), FREE, [0.0] * 3, 0.0)
    start, velocity, h = plant.position.copy(), plant.velocity.copy(), 1e-6
    plant.step(np.zeros(4), FREE, [0.0] * 3, h)
    np.testing.assert_allclose((plant.position - start) / h, velocity, atol=1e-4)


def test_closed_brakes_stop_and_hold_up_to_their_torque() -> None:
    plant = arm()
    plant.qd[:] = 3.0, -3.0, 4.0, 2.0
    for _ in range(100):
        plant.step(np.zeros(4), [True] * 4, [3.0, 3.0, 0.0], 1e-3)
    np.testing.assert_allclose(plant.qd, 0.0, atol=1e-12)
    posture = plant.q.copy()
    for _ in range(200):
        plant.step(np.zeros(4), [True] * 4, [3.0, 3.0, 0.0], 1e-3)
    np.testing.assert_allclose(plant.q, posture, atol=1e-12)
    weak = arm(brake=0.1)
    for _ in range(200):
        weak.step(np.zeros(4), [True] * 4, [3.0, 3.0, 0.0], 1e-3)
    assert np.abs(weak.qd).max() > 0.1


def test_a_finger_pulls_towards_its_course_as_strongly_as_it_can() -> None:
    hand = PointHand(Path([0.0, 1.0], np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])), 100.0, 10.0, 5.0)
    np.testing.assert_allclose(hand.force(0.0, [0.01, 0.0, 0.0], [0.0, 0.1, 0.0]), [-1.0, -1.0, 0.0])
    far = hand.force(1.0, [-10.0, 0.0, 0.0], [0.0] * 3)
    np.testing.assert_allclose(far, [5.0, 0.0, 0.0])
    hand.gripping = False
    assert hand.force(0.0, [1.0, 0.0, 0.0], [0.0] * 3) == [0.0] * 3


@pytest.mark.parametrize(("stiffness", "damping"), [(HandStiffness, 0.0), (HandStiffness, 1e3), (None, 1e3)])
def test_the_stiffest_finger_holds_the_tip_and_at_rest_it_is_a_spring(
    stiffness: type[HandStiffness] | None, damping: float
) -> None:
    plant, allowed = arm(friction=0.05), HandStiffness.range
    assert allowed
    k = allowed.upper if stiffness else allowed.lower
    place, hold = plant.position + np.array([0.01, -0.005, 0.0]), plant.hold
    course = Path([0.0, 1.0], np.array([place, place]))
    hand, torque = PointHand(course, k, damping, 2000.0), np.array([0.02, -0.01, 0.01, 0.005])
    plant.qd[:] = 1.0, -0.5, 2.0, 0.5
    plant.step(torque, FREE, [0.0] * 3, 0.0)
    before, fastest = plant.energy() + 0.5 * k * 0.01118**2, 0.0
    for _ in range(6000):
        hand.aim(hold, 0.0, plant.position.tolist())
        plant.step(torque, FREE, [0.0] * 3, 5e-4)
        fastest = max(fastest, plant.energy())
    assert fastest < 1.01 * before + 0.05
    if stiffness:
        np.testing.assert_allclose(
            hold.wrench, k * (place - plant.position) - damping * plant.velocity, atol=0.02
        )
        assert np.linalg.norm(place - plant.position) < 1e-4
