"""Tracking torques against the rigid-body equations, and on a series-elastic arm."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.control.ability import Ability
from hapticd.control.serial import SerialChain
from hapticd.control.tracking import Admitted, DriveFriction, SeriesElasticity, Tracking
from hapticd.models import Robot
from hapticd.sim.dynamics import SeriesElasticArm
from hapticd.sim.friction import Friction
from hapticd.testing.push import push

DT = 1e-3
ROTOR = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15])
STIFFNESS = np.array([15e3, 15e3, 8e3, 8e3, 2.5e3, 2.5e3])
P, D = np.array([6000, 6000, 2500, 2500, 500, 500.0]), np.array([180, 180, 75, 75, 15, 15.0])

SLOW = np.full(6, 0.02)
NONE = DriveFriction(*np.zeros((4, 6)), SLOW)
RUBS = DriveFriction(
    np.array([5.0, 5.0, 2.5, 2.5, 0.8, 0.8]),
    np.array([3.0, 3.0, 1.5, 1.5, 0.3, 0.3]),
    np.full(6, 0.05),
    np.array([0.8, 0.8, 0.4, 0.4, 0.1, 0.1]),
    SLOW,
)
ADMITTED = Admitted(*(np.full(6, most) for most in (100.0, 250.0, -2.0, 2.0)))


@pytest.fixture
def robot() -> Robot:
    return Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])


def track(
    robot: Robot,
    state: dict[str, np.ndarray],
    friction: DriveFriction = NONE,
    ability: Ability | None = None,
) -> Tracking:
    elasticity, chain = SeriesElasticity(ROTOR, STIFFNESS), SerialChain(robot, [])
    ability = ability or Ability(6)
    return Tracking(robot, chain, elasticity, friction, P, D, ADMITTED, ability, state, DT)


def inputs() -> dict[str, np.ndarray]:
    names = "q", "qd", "qdd", "wrench", "motor", "motor_rate", "link", "sensed"
    vectors = {name: np.zeros(6) for name in names}
    return vectors | {"J": np.zeros((6, 6))}


@pytest.mark.parametrize("rubs", [NONE, RUBS])
def test_feedforward_is_gravity_inertia_friction_and_wrench_and_the_rotor(
    robot: Robot, rubs: DriveFriction
) -> None:
    rng = np.random.default_rng(8)
    state = inputs()
    tracking = track(robot, state, rubs)
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
        way = state["qd"] / np.hypot(state["qd"], SLOW)
        spring = M @ state["qdd"] + h + robot.damping * state["qd"] - state["J"].T @ state["wrench"]
        spring += rubs.bearing * way
        gear = (rubs.gear + rubs.share * np.abs(spring)) * way + rubs.damping * state["qd"]
        # a motor exactly on its reference leaves the feedforward alone
        state["motor"][:], state["motor_rate"][:] = state["q"] + spring / STIFFNESS, state["qd"]
        torque = tracking.update(base)
        np.testing.assert_allclose(torque, spring + gear + ROTOR * state["qdd"], rtol=1e-9, atol=1e-9)


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


def test_friction_is_part_of_what_the_hierarchy_plans_with(robot: Robot) -> None:
    """Else a tight torque level would still be clamped behind it."""
    state, ability = inputs(), Ability(6)
    tracking, rng = track(robot, state, RUBS, ability), np.random.default_rng(5)
    tracking.update(np.zeros(2))  # a start is from rest
    for _ in range(5):
        for name in ("q", "qd", "qdd", "motor", "motor_rate"):
            state[name] += 0.01 * rng.standard_normal(6)
        tracking.forecast(np.zeros(2), planned=False)
        torque = tracking.update(np.zeros(2))
        planned = np.triu(ability.inertia) + np.triu(ability.inertia, 1).T
        expected = planned @ state["qdd"] + ability.load + ability.feedback
        np.testing.assert_allclose(torque, expected, rtol=1e-9, atol=1e-9)


def test_at_rest_no_friction_is_fed_forward_and_little_where_it_hardly_moves(robot: Robot) -> None:
    """Whatever the measured motors do: sticking joints cannot be made to hunt."""
    state = inputs()
    without, tracking = track(robot, state), track(robot, state, RUBS)
    state["motor_rate"][:] = np.random.default_rng(1).standard_normal(6)
    np.testing.assert_array_equal(tracking.update(np.zeros(2)), without.update(np.zeros(2)))
    state["qd"][:] = 1e-3 * SLOW
    added = tracking.update(np.zeros(2)) - without.update(np.zeros(2))
    assert np.abs(added).max() < 0.02


def test_a_wrench_that_is_no_number_spoils_no_torque_but_the_next(robot: Robot) -> None:
    state = inputs()
    tracking = track(robot, state, RUBS)
    state["J"][:] = np.eye(6)
    state["qd"][:] = 0.1
    for wrench in (1.0, np.nan, 1.0, 1.0):
        state["wrench"][:] = wrench
        torque = tracking.update(np.zeros(2)).copy()
    assert np.isfinite(torque).all()


RAMP = np.array([2000.0, 2000.0, 800.0, 800.0, 200.0, 200.0])
"""How a push grows that the springs carry [N m/s]."""


def wound(robot: Robot) -> tuple[Tracking, Ability, dict[str, np.ndarray]]:
    """Joints that stand while springs are wound up by a push, and motors that follow their references."""
    state, ability = inputs(), Ability(6)
    tracking = track(robot, state, ability=ability)
    state["J"][:] = np.eye(6)
    for k in range(60):
        state["wrench"][:] = -RAMP * k * DT
        tracking.forecast(np.zeros(2))
        tracking.update(np.zeros(2))
        state["motor"][:], state["motor_rate"][:] = ability.load / STIFFNESS, RAMP / STIFFNESS
    tracking.forecast(np.zeros(2))
    return tracking, ability, state


def test_motors_that_move_as_their_springs_yield_are_not_strained_and_those_that_stand_are(
    robot: Robot,
) -> None:
    tracking, ability, state = wound(robot)
    np.testing.assert_allclose(ability.feedback, -D * RAMP / STIFFNESS, rtol=0.01)
    assert (np.abs(ability.strain) < 0.03 * np.abs(ability.feedback)).all()
    state["motor_rate"][:] = 0.0
    for k in range(60, 90):
        state["wrench"][:] = -RAMP * k * DT
        tracking.update(np.zeros(2))
        tracking.forecast(np.zeros(2))
    np.testing.assert_allclose(ability.strain, (P * 0.03 + D) * RAMP / STIFFNESS, rtol=0.05)


@pytest.mark.parametrize("end", ["least", "most"])
def test_a_plan_that_is_all_that_motors_have_is_not_changed_for_yielding_in_either_direction(
    robot: Robot, end: str
) -> None:
    """Else the feedback changes the plan, the plan what yields, and that the feedback: springs ring."""
    tracking, ability, state = wound(robot)
    whole = np.triu(ability.inertia) + np.triu(ability.inertia, 1).T
    state["qdd"][:] = np.linalg.solve(whole, getattr(ability, end) - ability.load - ability.feedback)
    np.testing.assert_allclose(tracking.update(np.zeros(2)), getattr(ability, end), rtol=1e-9)


def test_with_torque_to_spare_what_springs_yield_is_fed_forward(robot: Robot) -> None:
    tracking, ability, state = wound(robot)
    whole = np.triu(ability.inertia) + np.triu(ability.inertia, 1).T
    state["qdd"][:] = np.linalg.solve(whole, -ability.load - ability.feedback)
    asked = (D / STIFFNESS + 2e-3) * RAMP
    np.testing.assert_allclose(tracking.update(np.zeros(2)), np.minimum(asked, 25.0), rtol=0.02)


def follow(
    robot: Robot,
    frequency: float,
    swing: float,
    plant: DriveFriction = NONE,
    believed: DriveFriction = NONE,
) -> float:
    """How far the links are from a reference that swings, at most, under a push [rad]."""
    plant_model = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    dry = Friction(plant.gear, plant.share, plant.bearing)
    damping, brake = np.array([20, 20, 10, 10, 2, 2.0]), np.full(6, 300.0)
    arm = SeriesElasticArm(plant_model, "handle", ROTOR, STIFFNESS, damping, brake, 4, dry)
    start = np.array([0.2, 1.4, -0.7, 0.5, 0.7, 0.1])
    arm.reset(start)
    state = inputs()
    tracking = track(robot, state, believed)
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


@pytest.mark.parametrize("wrong", [0.7, 1.3])
def test_friction_that_is_fed_forward_leaves_less_to_the_feedback(robot: Robot, wrong: float) -> None:
    """On a plant that rubs at rest as fully as in motion; known to 30 %."""
    rubs = DriveFriction(RUBS.gear, 0.0 * RUBS.damping, RUBS.share, RUBS.bearing, SLOW)
    believed = DriveFriction(wrong * RUBS.gear, rubs.damping, wrong * RUBS.share, wrong * RUBS.bearing, SLOW)
    before, after = (follow(robot, 0.3, 0.3, rubs, known) for known in (NONE, believed))
    assert after < 0.6 * before
