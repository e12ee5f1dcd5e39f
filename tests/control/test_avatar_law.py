"""The avatar's law: the impedance written out, its fade, its hold, and its lag."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.avatar_law import Impedance
from hapticd.experiments.following_arm import Avatar
from hapticd.experiments.moved_arm import HOME
from hapticd.models import Array

DT = 1e-3


def test_the_torque_is_that_of_the_paper() -> None:
    avatar, rng = Avatar(), np.random.default_rng(1)
    k = avatar.law
    for _ in range(20):
        avatar.command(*_pose(rng))
        for _ in range(3001):
            k.update(True)  # the fade is over; nothing moves
        avatar.q[:], avatar.qd[:] = HOME + rng.uniform(-0.9, 0.9, 7), rng.standard_normal(7)
        avatar.arm.update()
        avatar.avoidance.update()
        k.update(True)
        palm, arm = avatar.arm.palm, avatar.arm
        turn = pin.log3(palm.rotation @ k.commanded_rotation.T)
        error = np.concatenate([palm.position - k.commanded, turn])
        S, D = np.diag([600.0] * 3 + [30.0] * 3), np.diag([110.0] * 3 + [5.5] * 3)
        wrench = -S @ error - D @ (palm.J @ avatar.qd)
        expected = palm.J.T @ wrench + arm.null + arm.coriolis + avatar.avoidance.torque
        np.testing.assert_allclose(k.torque, expected, atol=1e-9)


def _pose(rng: np.random.Generator) -> tuple[Array, Array]:
    return np.array([0.5, 0.0, 0.5]) + rng.uniform(-0.1, 0.1, 3), pin.exp3(rng.uniform(-1, 1, 3)) @ np.diag(
        [1.0, -1.0, -1.0]
    )


def test_it_fades_on_a_straight_line_within_three_seconds() -> None:
    avatar = Avatar()
    law, start = avatar.law, avatar.arm.palm.position.copy()
    turned, first = pin.exp3(np.array([0.0, 0.0, 2.0])), avatar.arm.palm.rotation.copy()
    avatar.command(start + np.array([0.2, 0.0, 0.0]), first @ turned)
    for k in range(1, 3001):
        law.update(True)
        share = k / 3000
        assert np.abs(law.goal - start - np.array([0.2 * share, 0.0, 0.0])).max() < 1e-9
        assert np.linalg.norm(pin.log3(first.T @ law.goal_rotation)) == pytest.approx(2.0 * share, abs=1e-9)
    law.update(True)
    assert law.share == 1.0 and (law.goal == law.commanded).all()


def test_a_command_that_passes_the_half_turn_does_not_throw_the_goal_about() -> None:
    avatar = Avatar()
    first = avatar.arm.palm.rotation.copy()
    before = first.copy()
    for k in range(3000):
        angle = np.pi - 0.3 + 0.2e-3 * k
        avatar.command(avatar.arm.palm.position, first @ pin.exp3(np.array([0.0, 0.0, angle])))
        avatar.law.update(True)
        step = np.linalg.norm(pin.log3(before.T @ avatar.law.goal_rotation))
        assert step < 2.5e-3, k
        before = avatar.law.goal_rotation.copy()


def test_a_reconnection_with_an_offset_pulls_no_more_than_the_fade_lets_it() -> None:
    """20 cm: without the fade the spring would pull with 120 N in its first tick."""
    torques = {}
    for name, fade in (("fade", 3.0), ("none", DT)):
        avatar = Avatar(impedance=Impedance(fade=fade))
        avatar.command(avatar.arm.palm.position + np.array([0.0, 0.2, 0.0]), avatar.arm.palm.rotation)
        avatar.step(True)
        torques[name] = float(np.abs(avatar.law.torque).max())
    assert torques["fade"] < 0.02 * torques["none"]


def test_the_lag_behind_a_ramp_is_damping_by_stiffness() -> None:
    avatar = Avatar(masses=1.1)
    start, rotation = avatar.plant.position.copy(), avatar.plant.rotation.copy()
    avatar.law._core.share = 1.0
    for k in range(1800):
        avatar.command(start + np.array([0.0, 0.1e-3 * k, 0.0]), rotation)
        avatar.step(True)
    lag = (avatar.law.commanded[1] - avatar.plant.position[1]) / 0.1
    assert Impedance().lag < lag < 1.1 * Impedance().lag  # the joints' own viscous friction comes on top


def test_a_lost_command_is_held_within_a_millimetre_although_masses_are_wrong() -> None:
    """Pressing against a wall: what presses goes on pressing, what holds up the arm goes on holding it."""
    avatar = Avatar(masses=1.15)
    start, rotation = avatar.plant.position.copy(), avatar.plant.rotation.copy()
    avatar.law._core.share = 1.0
    avatar.command(start, rotation)
    wall = start[0] - 0.015
    for _ in range(1500):
        avatar.push[0] = -1000.0 * (avatar.plant.position[0] - wall)
        avatar.step(True)
    held = avatar.plant.position.copy()
    assert start[2] - held[2] > 5e-3  # the spring alone lets it sag
    assert avatar.push[0] < -3.0
    off = []
    for _ in range(3000):
        avatar.push[0] = -1000.0 * max(0.0, avatar.plant.position[0] - wall)
        avatar.step(False)
        off.append(np.linalg.norm(avatar.plant.position - held))
    assert max(off) < 1e-3


def test_a_held_arm_pushes_back_with_no_more_than_spring_and_bound() -> None:
    avatar = Avatar()
    for _ in range(1500):
        avatar.push[0] = -60.0
        avatar.step(False)
    assert np.linalg.norm(list(avatar.law._core.steady)[:3]) <= 20.0 + 1e-9


def test_an_impedance_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(ValueError, match="above 0"):
        Impedance(stiffness=0.0)
