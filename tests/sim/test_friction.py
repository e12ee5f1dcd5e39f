"""Dry friction by maximum dissipation: against every guess of what sticks, a ramp, and energy."""

from __future__ import annotations

from itertools import product

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.models import Array, Robot
from hapticd.sim.dynamics import DirectArm, HeldArm, SeriesElasticArm
from hapticd.sim.friction import Friction, braked_speed, dry_impulse
from hapticd.sim.hold import Hold, chain
from hapticd.testing.push import push

STILL = np.zeros(3)
START = np.array([0.0, np.pi / 2, -0.67, 0.3, 0.9, 0.1])
ROTOR = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15])
STIFFNESS = np.array([15e3, 15e3, 8e3, 8e3, 2.5e3, 2.5e3])


def problem(rng: np.random.Generator, n: int, spread: float) -> tuple[Array, Array, Array]:
    """Inverse inertia of a condition of up to e^(2 spread), speeds, largest impulses; some are free."""
    turn = np.linalg.qr(rng.standard_normal((n, n)))[0]
    A = turn @ np.diag(np.exp(rng.uniform(-spread, spread, n))) @ turn.T
    most = rng.uniform(0.0, 2.0, n) * rng.integers(0, 2, n)
    return 0.5 * (A + A.T), rng.standard_normal(n), most


def every_guess(A: Array, v: Array, most: Array) -> Array:
    """The least kinetic energy over all faces of the box."""
    n, best, least = len(v), np.zeros(len(v)), np.inf
    for state in product((0, 1, -1), repeat=n):
        p, held = np.array(state) * most, np.flatnonzero(np.array(state) == 0)
        if held.size:
            p[held] = np.linalg.solve(A[np.ix_(held, held)], -(v + A @ p)[held])
        cost = v @ p + 0.5 * p @ A @ p
        if np.all(np.abs(p) <= most * (1 + 1e-12)) and cost < least:
            best, least = p, cost
    return best


def test_impulses_are_the_best_of_every_guess() -> None:
    rng = np.random.default_rng(3)
    for _ in range(60):
        A, v, most = problem(rng, 4, 3.0)
        np.testing.assert_allclose(dry_impulse(A, v, most), every_guess(A, v, most), atol=1e-9)


@pytest.mark.parametrize("spread", [1.0, 5.0, 9.0])
def test_impulses_oppose_what_moves_stop_what_they_can_and_give_no_energy(spread: float) -> None:
    rng = np.random.default_rng(7)
    for _ in range(2000):
        A, v, most = problem(rng, 7, spread)
        p = dry_impulse(A, v, most)
        after, rounding = v + A @ p, 1e-9 * np.exp(spread) * (1.0 + np.abs(v).max())
        assert np.all(np.abs(p) <= most * (1.0 + 1e-9))
        assert v @ p + 0.5 * p @ A @ p <= rounding
        slides = np.abs(p) >= most * (1.0 - 1e-9)
        assert np.all(np.abs(after[~slides]) < rounding)
        assert np.all((p * after)[slides] <= rounding)


def giant() -> Robot:
    return Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])


def elastic(friction: Friction | None, substeps: int = 3, viscous: float = 1.0) -> SeriesElasticArm:
    robot, damping = giant(), viscous * np.array([20, 20, 10, 10, 2, 2.0])
    robot.damping *= viscous
    arm = SeriesElasticArm(robot, "handle", ROTOR, STIFFNESS, damping, np.full(6, 300.0), substeps, friction)
    arm.reset(START)
    return arm


def stiff(friction: Friction | None) -> DirectArm:
    arm = DirectArm(giant(), "handle", ROTOR, np.full(6, 300.0), 3, friction)
    arm.reset(START)
    return arm


def rubbing(gear: float = 0.0, share: float = 0.0, bearing: float = 0.0) -> Friction:
    sizes = np.array([1.0, 1.0, 0.5, 0.5, 0.2, 0.2])
    return Friction(gear * sizes, np.full(6, share), bearing * sizes)


@pytest.mark.parametrize("make", [elastic, stiff])
def test_what_sticks_does_not_creep(make: type[HeldArm]) -> None:
    arm = make(rubbing(bearing=40.0))
    hold = arm.spring.copy()
    push(arm.hold, np.array([8.0, -5.0, 6.0, 0.5, -0.3, 0.4]))
    for _ in range(3000):
        arm.step(hold, [False] * 6, STILL, 1e-3)
    np.testing.assert_array_equal(arm.q, START)  # to the last bit
    loose = make(None)
    push(loose.hold, np.array([8.0, -5.0, 6.0, 0.5, -0.3, 0.4]))
    for _ in range(300):
        loose.step(hold, [False] * 6, STILL, 1e-3)
    assert np.abs(loose.q - START).max() > 0.05


def test_a_rotor_breaks_loose_at_the_friction_of_its_gear() -> None:
    for excess, moves in ((-0.02, False), (0.02, True)):
        arm = elastic(rubbing(gear=30.0))
        torque = arm.spring.copy()
        torque[0] += 30.0 + excess
        before = arm.motor.copy()
        for _ in range(200):
            arm.step(torque, [False] * 6, STILL, 1e-3)
        assert bool(arm.motor[0] != before[0]) is moves
        np.testing.assert_array_equal(arm.motor[1:], before[1:])


def test_a_gear_that_carries_more_rubs_more() -> None:
    arm = elastic(rubbing(share=0.1))
    loaded = int(np.argmax(np.abs(arm.spring)))
    weight = float(arm.spring[loaded])
    assert abs(weight) > 5.0
    for share, moves in ((0.98, False), (1.02, True)):
        arm = elastic(rubbing(share=0.1))
        torque = arm.spring.copy()
        torque[loaded] += 0.1 * weight * share
        before = arm.motor.copy()
        arm.step(torque, [False] * 6, STILL, 1e-3)
        assert bool(arm.motor[loaded] != before[loaded]) is moves


def test_a_sliding_hinge_comes_to_rest_where_mechanics_says() -> None:
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), 0.5 * np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("handle", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    friction = Friction(np.array([1.5]), np.zeros(1), np.array([0.5]))
    arm = DirectArm(Robot(model), "handle", np.array([0.5]), np.zeros(1), 4, friction)
    arm.reset(np.zeros(1))
    arm.qd[:] = 3.0
    for k in range(1, 2001):  # 1 kg m^2 under 2 N m: at rest after 1.5 s and 0.5 * 3 * 1.5 rad
        arm.step(np.zeros(1), [False], STILL, 1e-3)
        assert arm.qd[0] == pytest.approx(max(0.0, 3.0 - 2.0 * k * 1e-3), abs=1e-9)
    assert arm.q[0] == pytest.approx(2.25, abs=1e-3)
    assert arm.work.dry == pytest.approx(-4.5, abs=1e-9)


@pytest.mark.parametrize("make", [elastic, stiff])
def test_brakes_and_friction_never_give_energy(make: type[HeldArm]) -> None:
    arm, rng = make(rubbing(gear=3.0, share=0.1, bearing=1.0)), np.random.default_rng(5)
    last = arm.work
    for k in range(3000):
        if k % 200 == 0:
            torque = arm.spring + rng.uniform(-40, 40, 6)
            push(arm.hold, rng.uniform(-1, 1, 6) * [30, 30, 30, 3, 3, 3])
            braked = (rng.random(6) < 0.2).tolist()
        arm.step(torque, braked, STILL, 1e-3)
        now = arm.work
        assert now.dry <= last.dry + 1e-12
        last = now
    assert now.dry < -50.0


def balance(arm: HeldArm, ticks: int, seed: int) -> float:
    """Largest difference of energy and work on the way [J]."""
    rng, worst = np.random.default_rng(seed), 0.0
    hold = arm.hold
    hold.stiffness[:], hold.damping[:], hold.strength[:] = (900, 30), (40, 1.2), (150, 12)
    start = arm.kinetic_energy() + arm.spring_energy() + arm.potential_energy()
    place, hold_torque = arm.position.copy(), arm.spring.copy()
    for k in range(ticks):
        if k % 150 == 0:
            torque, braked = hold_torque + rng.uniform(-30, 30, 6), (rng.random(6) < 0.15).tolist()
        wanted = place + 0.15 * np.sin(2e-3 * k * np.array([1.0, 1.7, 2.3]))
        hold.error[:] = [*(wanted - arm.position), 0.0, 0.0, 0.0]
        arm.step(torque, braked, STILL, 1e-3)
        energy = arm.kinetic_energy() + arm.spring_energy() + arm.potential_energy()
        work = arm.work
        done = work.motors + work.hand + work.dry + work.damping
        worst = max(worst, abs(energy - start - done))
    assert -work.dry > 5.0 and abs(work.hand) > 1.0 and abs(work.motors) > 1.0 and work.damping < -0.5
    return worst


def test_the_gain_in_energy_is_the_work_of_hand_motors_brakes_and_friction() -> None:
    friction = rubbing(gear=3.0, share=0.1, bearing=1.0)
    worst = [balance(elastic(friction, substeps), 1500, 11) for substeps in (3, 12, 48)]
    assert worst[0] < 0.06  # of more than 100 J that flow
    assert worst[0] > 2.5 * worst[1] > 6.25 * worst[2]


def test_the_same_holds_where_nothing_yields() -> None:
    arm = stiff(rubbing(gear=3.0, share=0.1, bearing=1.0))
    assert balance(arm, 1500, 11) < 0.06


def test_brakes_that_are_too_weak_slow_as_much_as_they_can_and_open_ones_do_nothing() -> None:
    M, qd = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([1.0, -2.0])
    np.testing.assert_array_equal(braked_speed(M, qd, [False, False], np.ones(2)), qd)
    held = braked_speed(M, qd, [True, True], np.full(2, 10.0))
    np.testing.assert_allclose(held, 0.0, atol=1e-12)
    one = braked_speed(M, qd, [True, False], np.full(2, 10.0))
    # the other keeps its momentum
    np.testing.assert_allclose(one, [0.0, qd[1] + 0.5 * qd[0]], atol=1e-12)
    weak = braked_speed(M, qd, [True, True], np.full(2, 0.1))
    np.testing.assert_allclose(M @ (weak - qd), [-0.1, 0.1])


def test_more_joints_than_c_has_room_for_are_refused() -> None:
    n = 17
    with pytest.raises(ValueError, match="17 joints"):
        dry_impulse(np.eye(n), np.zeros(n), np.ones(n))
    with pytest.raises(ValueError, match="17 joints"):
        chain(Hold(), np.eye(n), np.zeros((6, n)), np.zeros(n), np.zeros(n))


def test_what_a_bearing_holds_does_not_pass_through_the_sensor_and_what_a_gear_holds_does() -> None:
    for friction, passes in ((rubbing(gear=60.0), 1.0), (rubbing(bearing=60.0), 0.0)):
        arm = stiff(friction)
        weight = arm.spring.copy()
        assert np.abs(weight).max() > 5.0
        for _ in range(5):
            arm.step(np.zeros(6), [False] * 6, STILL, 1e-3)
        np.testing.assert_array_equal(arm.q, START)
        np.testing.assert_allclose(arm.spring, passes * weight, atol=1e-9)
