"""A hand's hold: the closed form of its step, its limits, and that no grip is too stiff for what it holds."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hapticd.binding.bind import pointer
from hapticd.configs import read_text
from hapticd.configs.quantities import HandAngularDamping, HandAngularStiffness, HandDamping, HandStiffness
from hapticd.models import Robot
from hapticd.sim._plant import lib
from hapticd.sim.dynamics import DirectArm, SeriesElasticArm
from hapticd.sim.hold import Hold, chain

STILL = np.zeros(3)
INERTIA, ROTOR = 4e-4, 2e-4
PLACE = 0.3
"""Where the hand wants a hinge [rad]."""


def hinge(substeps: int) -> DirectArm:
    """A handle of 6e-4 kg m^2 that turns about the vertical."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(joint, pin.Inertia(0.1, np.zeros(3), INERTIA * np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("handle", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    arm = DirectArm(Robot(model), "handle", np.array([ROTOR]), np.zeros(1), substeps)
    arm.reset(np.zeros(1))
    return arm


def turn(arm: DirectArm, ticks: int, stiffness: float, damping: float, strength: float = 1e6) -> list[float]:
    """Angles after each tick under a hand that wants it at PLACE."""
    hold, angles = arm.hold, []
    hold.stiffness[1], hold.damping[1], hold.strength[1] = stiffness, damping, strength
    for _ in range(ticks):
        hold.error[:] = [0, 0, 0, 0, 0, PLACE - arm.q[0]]
        arm.step(np.zeros(1), [False], STILL, 1e-3)
        angles.append(float(arm.q[0]))
    return angles


def test_a_step_is_that_of_implicit_euler() -> None:
    arm, h, k, d, inertia = hinge(2), 5e-4, 30.0, 1.2, INERTIA + ROTOR
    q = v = 0.0
    for _ in range(40):
        for _ in range(2):
            v = (inertia * v + h * k * (PLACE - q)) / (inertia + h * d + h * h * k)
            q += h * v
        assert turn(arm, 1, k, d)[0] == pytest.approx(q, abs=1e-13)
        assert arm.hold.wrench[5] == pytest.approx(k * (PLACE - q) - d * v, abs=1e-11)


@pytest.mark.parametrize("rows", [3, 6])
@pytest.mark.parametrize("strength", [1e6, 1.0])
def test_hand_and_friction_together_keep_momentum_and_each_its_own_law(rows: int, strength: float) -> None:
    rng, n, h = np.random.default_rng(rows), 5, 3e-4
    held, inverse, J = Hold(rows), np.zeros((n, n)), np.zeros((rows, n))
    dry, friction, v, stuck = np.zeros(n), np.zeros(n), np.zeros(n), 0
    core, speeds = chain(held, inverse, J, dry, friction), pointer(v, "double", n)
    for _ in range(200):
        half = rng.standard_normal((n, n))
        M = half @ half.T + 0.05 * np.eye(n)
        inverse[:], J[:] = np.linalg.inv(M), rng.standard_normal((rows, n))
        dry[:] = rng.uniform(0.0, 1e5, n) * rng.integers(0, 2, n) * 10.0 ** -rng.integers(0, 4)
        held.stiffness[:], held.damping[:] = rng.uniform(0, 1e5, 2), rng.uniform(0, 1e3, 2)
        held.strength[:] = strength
        held.error[:], held.rate[:] = 0.1 * rng.standard_normal(rows), rng.standard_normal(rows)
        error, v[:] = held.error.copy(), 3.0 * rng.standard_normal(n)
        before = v.copy()
        lib.held_step(core, h, speeds)
        w, k, d = held.wrench, np.repeat(held.stiffness, 3)[:rows], np.repeat(held.damping, 3)[:rows]
        np.testing.assert_allclose(M @ (v - before), h * (J.T @ w + friction), atol=1e-8 * np.abs(M).max())
        np.testing.assert_allclose(held.error, error + h * (held.rate - J @ v), atol=1e-12)
        spring = k * held.error + d * (held.rate - J @ v)
        for part in np.split(np.arange(rows), rows // 3):
            if np.linalg.norm(w[part]) < strength * (1.0 - 1e-9):
                np.testing.assert_allclose(w[part], spring[part], atol=1e-6 * np.abs(k * error).max())
            else:
                assert np.linalg.norm(spring[part]) >= strength * (1.0 - 1e-6)
                assert np.linalg.norm(w[part]) == pytest.approx(strength)
        slides = np.abs(friction) >= dry * (1.0 - 1e-9)
        assert np.all(np.abs(friction) <= dry * (1.0 + 1e-9))
        assert np.all(v[~slides] == 0.0) and np.all((friction * v)[slides] <= 1e-9)
        stuck += int(np.count_nonzero(~slides))
    assert stuck > 100


def test_only_what_its_own_law_asks_so_much_of_gives_all_its_strength() -> None:
    """A hand that pulls with all its force does not turn its wrist for that."""
    rng, n, h, turns = np.random.default_rng(7), 6, 5e-4, 0
    held, inverse, J = Hold(6), np.zeros((n, n)), np.zeros((6, n))
    core = chain(held, inverse, J, np.zeros(n), np.zeros(n))
    held.stiffness[:], held.damping[:], held.strength[:] = (2000.0, 11.0), (23.0, 1.2), (28.0, 8.0)
    for _ in range(200):
        half = rng.standard_normal((n, n))
        inverse[:], J[:] = np.linalg.inv(half @ half.T + 0.5 * np.eye(n)), rng.standard_normal((6, n))
        held.error[:] = [*rng.standard_normal(3), *(0.2 * rng.standard_normal(3))]
        held.rate[:] = 0.3 * rng.standard_normal(6)
        v = 0.1 * rng.standard_normal(n)
        lib.held_step(core, h, pointer(v, "double", n))
        spring = np.repeat([2000.0, 11.0], 3) * held.error + np.repeat([23.0, 1.2], 3) * (held.rate - J @ v)
        for part, strength in ((slice(3), 28.0), (slice(3, 6), 8.0)):
            if np.linalg.norm(held.wrench[part]) >= strength * (1.0 - 1e-9):
                assert np.linalg.norm(spring[part]) >= strength * (1.0 - 1e-6)
            else:
                np.testing.assert_allclose(held.wrench[part], spring[part], atol=1e-6)
                turns += part.start == 3
    assert turns > 100


def test_smaller_steps_come_closer_to_the_overdamped_closed_form() -> None:
    k, d, inertia = 30.0, 1.2, INERTIA + ROTOR
    root = np.sqrt(d * d - 4 * inertia * k)
    fast, slow = -(d + root) / (2 * inertia), -(d - root) / (2 * inertia)
    t = 1e-3 * np.arange(1, 101)
    exact = PLACE * (1 - (slow * np.exp(fast * t) - fast * np.exp(slow * t)) / (slow - fast))
    errors = [np.abs(turn(hinge(substeps), 100, k, d) - exact).max() for substeps in (2, 8, 32)]
    assert errors[0] < 3e-3
    assert errors[0] > 3 * errors[1] > 9 * errors[2]


def test_a_hand_gives_no_more_than_its_strength_and_that_is_a_constant_torque() -> None:
    arm, t = hinge(4), 5e-3
    angles = turn(arm, 5, 30.0, 0.1, strength=0.01)
    # 0.5 a t^2, and what symplectic Euler adds
    assert angles[-1] == pytest.approx(0.5 * 0.01 / (INERTIA + ROTOR) * t * (t + 1e-3 / 4), rel=1e-9)
    assert arm.hold.wrench[5] == pytest.approx(0.01)


@pytest.mark.parametrize("strength", [1e6, 3.0])
def test_the_stiffest_grip_that_a_configuration_accepts_holds_a_light_handle_still(strength: float) -> None:
    most, least = HandAngularStiffness.range, HandAngularDamping.range
    assert most and least
    for stiffness in (most.lower, 1.0, most.upper):
        for damping in (0.0, 1.2, least.upper):
            arm = hinge(1)
            arm.qd[:] = 5.0
            angles = np.array(turn(arm, 500, stiffness, damping, strength))
            assert np.abs(angles).max() < 10.0
            energy = 0.5 * stiffness * (angles - PLACE) ** 2
            start = 0.5 * (INERTIA + ROTOR) * 25.0 + 0.5 * stiffness * PLACE**2
            assert energy.max() <= start * (1.0 + 1e-9)


def test_the_stiffest_grip_holds_the_giants_handle_and_at_rest_it_is_a_spring() -> None:
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    rotor, springs = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15]), np.array([15, 15, 8, 8, 2.5, 2.5]) * 1e3
    damping = np.array([20, 20, 10, 10, 2, 2.0])
    arm = SeriesElasticArm(robot, "handle", rotor, springs, damping, np.full(6, 500.0), 3)
    arm.reset(np.array([0.0, np.pi / 2, -0.67, 0.3, 0.9, 0.1]))
    ranges = (HandStiffness.range, HandAngularStiffness.range, HandDamping.range, HandAngularDamping.range)
    k, k_r, d, d_r = (allowed.upper for allowed in ranges if allowed)
    hold, place, gap = arm.hold, arm.position + np.array([0.002, -0.001, 0.001]), np.zeros(3)
    hold.stiffness[:], hold.damping[:], hold.strength[:] = (k, k_r), (d, d_r), (2000.0, 200.0)
    for _ in range(1500):
        gap = place - arm.position
        hold.error[:] = [*gap, 0.0, 0.0, 0.0]
        arm.step(arm.spring.copy(), [True] * 6, STILL, 1e-3)
        assert np.abs(arm.qd).max() < 2.0
    assert np.abs(arm.qd).max() < 1e-4
    np.testing.assert_allclose(hold.wrench[:3], k * gap, rtol=2e-3, atol=1e-2)


def test_it_pulls_towards_its_place_with_all_the_force_it_has_and_turns_as_before() -> None:
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    arm = DirectArm(robot, "handle", np.full(6, 1.5), np.zeros(6), 64)
    arm.reset(np.array([0.0, np.pi / 2, -0.67, 0.3, 0.9, 0.1]))
    away = np.array([3.0, -1.0, 0.5])
    arm.hold.stiffness[:], arm.hold.damping[:], arm.hold.strength[:] = (900, 30), (40, 1.2), (150, 12)
    arm.hold.error[:] = [*away, 0.1, -0.05, 0.2]
    arm.step(np.zeros(6), [False] * 6, STILL, 1e-5)
    np.testing.assert_allclose(arm.hold.wrench[:3], 150 * away / np.linalg.norm(away), rtol=1e-4)
    np.testing.assert_allclose(arm.hold.wrench[3:], [3.0, -1.5, 6.0], rtol=2e-3)
