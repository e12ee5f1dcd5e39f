"""What the dashboard shows of a redundant interface's strength, beside the controller's own kinematics."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from hapticd.machines.rhi.machine import redundant_arm
from hapticd.runtime.configuration.config import load
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.scene import Strength
from hapticd.view.geometry import Grips
from hapticd.view.source import Drawn
from hapticd.view.strength import Pressing

SESSION = build(load("rhi"))
assert SESSION.system.scene is not None
SCENE = SESSION.system.scene(SESSION.config)
CONFIG = SESSION.config
ARM = redundant_arm(CONFIG, SESSION.robot)
LIMIT = np.array(CONFIG.rhi.motors.torque)
POSTURES = np.random.default_rng(11).uniform(-0.6, 0.6, (20, ARM.n)) + np.array(CONFIG.rhi.task.home)


def logged(motors: np.ndarray) -> np.void:
    state = np.zeros((), SESSION.cycle.machine.state)
    state["q"], state["demand"] = motors, [3.0, -4.0]
    return state[()]


def pressing() -> Pressing:
    assert SCENE.strength is not None
    return Pressing(SESSION.robot, SCENE.grips[0], SCENE.strength)


@pytest.mark.parametrize("motors", POSTURES)
def test_the_grip_is_drawn_where_the_controller_has_the_hand(motors: np.ndarray) -> None:
    state = logged(motors)
    ((place, _),) = Grips(SESSION.robot, SCENE.grips).place(SCENE.posture(state), SCENE.wrench(state))
    np.testing.assert_allclose(place.translation[: ARM.m], ARM.at(motors).position, atol=1e-12)


@pytest.mark.parametrize("motors", POSTURES)
def test_a_force_on_the_ellipsoid_costs_the_motors_their_torques_in_all(motors: np.ndarray) -> None:
    """And the semi-axes are orthogonal: for each such force the sum of (torque / largest torque)^2 is one."""
    semi = np.reshape(pressing().axes(SCENE.posture(logged(motors))), (-1, 3))
    assert semi.shape == (2, 3) and not semi[:, 2].any()
    assert abs(semi[0] @ semi[1]) < 1e-9 * np.linalg.norm(semi[0]) * np.linalg.norm(semi[1])
    J = ARM.at(motors).J
    for angle in np.linspace(0.0, 2.0 * np.pi, 7):
        force = np.cos(angle) * semi[0, :2] + np.sin(angle) * semi[1, :2]
        assert np.sum((J.T @ force / LIMIT) ** 2) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("motors", POSTURES)
def test_the_reachable_force_takes_one_motor_to_its_limit_and_none_beyond(motors: np.ndarray) -> None:
    state = logged(motors)
    assert SCENE.strength is not None
    demand = SCENE.strength.demand(state)
    assert demand == [3.0, -4.0, 0.0]
    force = np.array(pressing().reachable(SCENE.posture(state), demand))
    assert force @ demand == pytest.approx(np.linalg.norm(force) * 5.0)
    share = np.abs(ARM.at(motors).J.T @ force[:2]) / LIMIT
    assert share.max() == pytest.approx(1.0, rel=1e-9)


def test_where_no_force_is_asked_for_none_is_reachable() -> None:
    assert pressing().reachable(POSTURES[0].tolist(), [0.0, 0.0, 0.0]) == []


def test_a_posture_that_carries_any_force_in_a_direction_has_no_axis_there() -> None:
    """Stretched out, a planar chain presses along itself without its motors."""
    lean = Strength((1.0,) * 4, tuple(map(tuple, np.eye(4))), (0, 1), lambda _: (1.0, 0.0, 0.0))
    stretched = [0.0, np.pi / 2, -np.pi / 2, np.pi / 2]
    chain = Pressing(SESSION.robot, SCENE.grips[0], lean)
    assert len(chain.axes(stretched)) == 3
    assert np.isfinite(chain.reachable(stretched, [1.0, 0.0, 0.0])).all()


def test_a_page_is_told_of_both() -> None:
    from hapticd.runtime.recording.frames import Frame

    state = logged(POSTURES[0])
    frame = Frame(tick=1, ticks=1, published_ns=0, mode="ACTIVE")
    frame.posture, frame.wrench = list(SCENE.posture(state)), list(SCENE.wrench(state))
    frame.demand = [3.0, -4.0, 0.0]
    said = msgspec.json.decode(Drawn(SESSION).frame(frame))
    assert len(said["strength"]) == 6 and len(said["reachable"]) == 3


@pytest.mark.parametrize("motors", np.random.default_rng(5).uniform(-0.5, 0.5, (5, 7)))
def test_of_an_arm_with_weight_the_motors_hold_both_and_no_more(motors: np.ndarray) -> None:
    session = build(load("panda_rhi"))
    config = session.config
    assert session.system.scene is not None
    scene = session.system.scene(config)
    assert scene.strength is not None
    q = motors + np.array(config.rhi.task.home)
    demand = [10.0, -20.0, 30.0]
    force = np.array(Pressing(session.robot, scene.grips[0], scene.strength).reachable(q.tolist(), demand))
    arm = redundant_arm(config, session.robot).at(q)
    share = (np.abs(arm.J.T @ force) + np.abs(arm.weight)) / np.array(config.rhi.motors.torque)
    assert np.abs(arm.weight).max() > 1.0 and share.max() == pytest.approx(1.0, rel=1e-6)
