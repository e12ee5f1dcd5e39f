"""The plant's dynamics: energy, closed forms, brakes, and a prescribed base."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.models import Robot
from hapticd.sim.dynamics import SeriesElasticArm, VelocityAxes
from hapticd.testing.push import push

ROTOR = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15])
STIFFNESS = np.array([15e3, 15e3, 8e3, 8e3, 2.5e3, 2.5e3])
POSTURE = np.array([0.0, np.pi / 2, -0.67, 0.3, 0.9, 0.1])
FREE, NOTHING = [False] * 6, np.zeros(6)


def make(damped: bool = False, substeps: int = 4, factor: float = 1.0) -> SeriesElasticArm:
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    if not damped:
        robot.damping[:] = 0.0
    damping = np.array([20, 20, 10, 10, 2, 2.0]) if damped else np.zeros(6)
    damping[:4] *= factor
    arm = SeriesElasticArm(robot, "handle", ROTOR, STIFFNESS, damping, np.full(6, 300.0), substeps)
    arm.reset(POSTURE)
    return arm


def run(
    arm: SeriesElasticArm, ticks: int, wrench: np.ndarray = NOTHING, base: np.ndarray | None = None
) -> None:
    push(arm.hold, wrench)
    for _ in range(ticks):
        arm.step(np.zeros(6), FREE, np.zeros(3) if base is None else base, 1e-3)


def test_without_friction_a_falling_arm_keeps_its_energy() -> None:
    arm = make()
    before = arm.energy()
    kinetic = 0.0
    for _ in range(300):
        run(arm, 1)
        kinetic = max(kinetic, float(np.abs(arm.qd).max()))
        assert abs(arm.energy() - before) < 5e-3
    assert kinetic > 1.0  # it really fell


def test_the_energy_error_shrinks_with_the_step() -> None:
    drift = []
    for substeps in (2, 8, 32):
        arm = make(substeps=substeps)
        before = arm.energy()
        run(arm, 300)
        drift.append(abs(arm.energy() - before))
    assert drift[0] > 3 * drift[1] > 9 * drift[2]


def test_friction_and_spring_damping_only_take_energy() -> None:
    arm = make(damped=True)
    last = arm.energy()
    for _ in range(500):
        run(arm, 1)
        now = arm.energy()
        assert now < last + 1e-4
        last = now


def test_a_loaded_arm_at_rest_stays_at_rest_when_the_motors_hold_gravity() -> None:
    arm = make(damped=True)
    hold = arm.spring.copy()
    for _ in range(500):
        arm.step(hold, FREE, np.zeros(3), 1e-3)
    np.testing.assert_allclose(arm.q, POSTURE, atol=1e-9)


def test_a_slow_push_bends_the_springs_by_the_static_amount() -> None:
    arm = make(damped=True, factor=20.0)  # the real springs swing for seconds
    wrench = np.array([10.0, -5.0, 8.0, 0.2, 0.1, -0.3])
    motor = arm.motor.copy()
    push(arm.hold, wrench)
    for _ in range(3000):  # rotors locked by their brakes
        arm.step(np.zeros(6), [True] * 6, np.zeros(3), 1e-3)
    np.testing.assert_allclose(arm.motor, motor, atol=1e-9)
    robot = arm._robot
    qp = robot.configuration(arm.q)
    J = pin.computeFrameJacobian(robot.model, robot.data, qp, robot.frame("handle"), pin.LOCAL_WORLD_ALIGNED)
    gravity = pin.computeGeneralizedGravity(robot.model, robot.data, qp)
    np.testing.assert_allclose(STIFFNESS * (arm.motor - arm.q), gravity - J.T @ wrench, atol=1e-3)
    assert np.abs(arm.qd).max() < 1e-6


def test_an_accelerated_base_acts_like_the_whole_eight_joint_robot_with_prescribed_axes() -> None:
    full = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf")
    arm = make(substeps=1)
    base = np.array([1.2, -0.7, 0.0])
    run(arm, 1, base=base)
    # hybrid dynamics: with the axes' acceleration prescribed, rnea of the result gives the joint torques
    q = np.concatenate([np.zeros(2), POSTURE])
    qdd = np.concatenate([base[:2], arm.qdd])
    tau = pin.rnea(full.model, full.data, full.configuration(q), np.zeros(8), qdd)
    spring_at_start = pin.computeGeneralizedGravity(full.model, full.data, full.configuration(q))[2:]
    np.testing.assert_allclose(tau[2:], spring_at_start, atol=1e-9)


def test_brakes_stop_a_moving_rotor_without_reversing_it() -> None:
    arm = make(damped=True)
    arm.motor_rate[:] = 0.5
    arm.qd[:] = 0.5
    for _ in range(100):
        arm.step(np.zeros(6), [True] * 6, np.zeros(3), 1e-3)
    assert np.abs(arm.motor_rate).max() < 1e-9


def test_a_velocity_axis_follows_its_command_with_its_time_constant_and_rating() -> None:
    axes = VelocityAxes(0.05, 3.0, [-1.0], [1.0])
    for _ in range(50):
        axes.step([0.1], [False], 1e-3)
    assert axes.velocity[0] == pytest.approx(0.1 * (1 - np.exp(-1)), rel=2e-2)
    for _ in range(100):
        axes.step([2.0], [False], 1e-3)
        assert axes.acceleration[0] <= 3.0 + 1e-9
    for _ in range(2000):
        axes.step([2.0], [False], 1e-3)
    assert axes.position == [1.0] and axes.velocity == [0.0]  # the hard stop


def test_a_braked_axis_stops_at_its_rated_deceleration() -> None:
    axes = VelocityAxes(0.05, 3.0, [-10.0], [10.0])
    axes.velocity[0] = 0.6
    for _ in range(199):
        axes.step([0.6], [True], 1e-3)
    assert 0.0 < axes.velocity[0] < 0.01
    axes.step([0.6], [True], 1e-3)
    axes.step([0.6], [True], 1e-3)
    assert axes.velocity[0] == pytest.approx(0.0, abs=1e-12)


def test_axes_move_as_their_formula_says_to_the_last_bit() -> None:
    random = np.random.default_rng(2)
    constant, rated, lower, upper, dt = 0.04, 3.0, [-0.2, -0.1, 0.0], [0.2, 0.3, 0.05], 2e-3
    axes = VelocityAxes(constant, rated, lower, upper)
    x, v, stops = [0.0] * 3, [0.0] * 3, 0
    for _ in range(2000):
        command, braked = random.normal(0.0, 1.0, 3), random.random(3) < 0.2
        axes.step(command, braked, dt)
        for i in range(3):
            target, after = (0.0, dt) if braked[i] else (command[i], constant)
            speed = v[i] + dt * min(max((target - v[i]) / after, -rated), rated)
            place = x[i] + dt * speed
            x[i] = min(max(place, lower[i]), upper[i])
            speed = speed if x[i] == place else 0.0
            stops += x[i] != place
            assert axes.acceleration[i] == (speed - v[i]) / dt
            v[i] = speed
        assert axes.position.tolist() == x and axes.velocity.tolist() == v
    assert stops > 10


def test_what_axes_carry_moves_in_their_directions_alone() -> None:
    axes = VelocityAxes(0.05, 3.0, [-1.0] * 2, [1.0] * 2)
    axes.step([0.1, -0.2], [False] * 2, 1e-3)
    rows = axes.position, axes.velocity, axes.acceleration
    np.testing.assert_array_equal(axes.carried, [[*row, 0.0] for row in rows])
    assert axes.velocity[0] > 0.0 > axes.velocity[1]
