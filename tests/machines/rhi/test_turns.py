"""A hand that moves and turns: kinematics against pinocchio and differences, force and torque of a tool."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.experiments.hands import session
from hapticd.experiments.temper import Temper
from hapticd.machines.rhi.bodies import surroundings
from hapticd.machines.rhi.config import RhiConfig
from hapticd.machines.rhi.machine import redundant_arm
from hapticd.machines.rhi.redundant import AXES, RedundantArm, Travel
from hapticd.machines.rhi.tool import Tool
from hapticd.models import Array, ModelError, Robot
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep

from ...runtime.conftest import changed

ROBOT = Robot.from_urdf(read_text("panda.urdf"), "panda.urdf")
ROTOR = np.full(7, 0.3)
HOME = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
LEVER = 0.15
METRES = np.array([1.0] * 3 + [10.0] * 3)
"""What makes torques forces at the lever of the built-in configuration [1/m]."""
SCALE = np.array([1.0] * 3 + [LEVER] * 3)


def loaded(*changes: tuple[str, str]) -> config.Loaded:
    """The built-in arm with a stamp, with some texts replaced."""
    text, model = changed(*changes, machine="panda_stamp"), read_text("panda.urdf")
    return config.Loaded("arm", config.parse(text, "arm.toml"), text, "arm.toml", model, "panda.urdf")


@cache
def described() -> RhiConfig:
    found = loaded().config
    assert isinstance(found, RhiConfig)
    return found


def six(transmission: Array | None = None) -> RedundantArm:
    T = np.eye(7) if transmission is None else transmission
    arm = RedundantArm(ROBOT, "handle", AXES, T, ROTOR, LEVER)
    arm.refer(HOME)
    return arm


def mixed() -> Array:
    return np.eye(7) + 0.2 * np.random.default_rng(4).standard_normal((7, 7))


def test_velocities_and_drift_are_pinocchio_s_through_any_transmission() -> None:
    T = mixed()
    arm, rng, data = six(T), np.random.default_rng(1), ROBOT.model.createData()
    frame = ROBOT.frame("handle")
    for _ in range(50):
        arm.q[:], arm.qd[:] = rng.uniform(-1.0, 1.0, 7), rng.normal(size=7)
        arm.update()
        joints, rates = ROBOT.configuration(T @ arm.q), T @ arm.qd
        pin.forwardKinematics(ROBOT.model, data, joints, rates, np.zeros(7))
        pin.updateFramePlacements(ROBOT.model, data)
        axes = pin.LOCAL_WORLD_ALIGNED
        twist = pin.getFrameVelocity(ROBOT.model, data, frame, axes).vector
        drift = pin.getFrameClassicalAcceleration(ROBOT.model, data, frame, axes).vector
        np.testing.assert_allclose(arm.velocity, SCALE * twist, atol=1e-12)
        np.testing.assert_allclose(arm.J @ arm.qd, SCALE * twist, atol=1e-12)
        np.testing.assert_allclose(arm.drift, SCALE * drift, atol=1e-11)
        turned = pin.log3(data.oMf[frame].rotation @ arm.reference.T)
        np.testing.assert_allclose(arm.position[3:], LEVER * turned, atol=1e-9)


def test_derivatives_are_those_of_central_differences() -> None:
    arm, h = six(mixed()), 1e-6
    for q in np.random.default_rng(2).uniform(-1.0, 1.0, (30, 7)):
        dJ = arm.at(q).dJ.copy()
        for k, step in enumerate(h * np.eye(7)):
            above, below = arm.at(q + step).J.copy(), arm.at(q - step).J.copy()
            np.testing.assert_allclose(dJ[k], (above - below) / (2 * h), atol=1e-7 * np.abs(dJ).max())


def test_what_a_hand_travels_is_what_its_velocity_adds_up_to() -> None:
    """A way that turns about one axis after the other: rotation vectors from the reference would not do."""
    arm, dt = six(), 1e-4
    travel, sums = Travel(arm), np.zeros(6)
    arm.at(HOME)
    travel.reset()
    first = np.array(travel.update())
    q = HOME.copy()
    for k in range(3000):
        arm.qd[:] = 2.0 * np.sin(1e-3 * k * np.arange(1, 8) / 3.0)
        arm.q[:] = q + 0.5 * dt * arm.qd
        arm.update()
        sums += dt * arm.velocity
        q += dt * arm.qd
        arm.q[:] = q
        arm.update()
        found = np.array(travel.update())
    np.testing.assert_allclose(found - first, sums, atol=1e-6)
    assert np.linalg.norm(sums[3:]) / LEVER > 0.5
    assert np.linalg.norm(sums[3:] - arm.position[3:]) / LEVER > 0.05


def test_force_and_torque_of_a_tool_are_the_derivative_of_its_energy() -> None:
    arm = redundant_arm(described(), ROBOT)
    tool = surroundings(described().rhi, arm)
    assert isinstance(tool, Tool)
    rng, h, touched = np.random.default_rng(3), 1e-6, 0

    def energy(q: Array) -> float:
        tool.force(arm.at(q).position.tolist())
        return tool.energy

    posture = np.array(described().simulation.rhi.posture)
    low = arm.at(posture).position.copy()
    low[2] = 0.345
    for _ in range(40):
        q = posture + 0.05 * rng.normal(size=7)
        for _ in range(20):  # down to the table, wherever else it goes
            q += np.linalg.pinv(arm.at(q).J[:3]) @ (low - arm.position)[:3]
        wrench = np.array(tool.force(arm.at(q).position.tolist()))
        expected = [(energy(q + d) - energy(q - d)) / (2 * h) for d in h * np.eye(7)]
        touched += tool.energy > 0.0
        np.testing.assert_allclose(-arm.at(q).J.T @ wrench, expected, rtol=2e-3, atol=2e-4)
    assert touched > 30


def test_the_place_that_postures_are_found_for_has_the_tool_s_point_on_the_surface() -> None:
    arm = redundant_arm(described(), ROBOT)
    tool = surroundings(described().rhi, arm)
    point, into = np.array([0.45, 0.05, 0.25]), np.array([0.0, 0.0, -1.0])
    place, push = tool.held(point, into)
    tip = arm.reference @ np.array(described().rhi.task.tool[0])
    np.testing.assert_allclose(place[:3] + tip, point)
    assert not place[3:].any() and np.linalg.norm(push) == pytest.approx(1.0)
    found = tool.surface((place - [0.0, 0.0, 0.01, 0.0, 0.0, 0.0]).tolist())
    np.testing.assert_allclose(found[0], place, atol=1e-6)
    np.testing.assert_allclose(found[1], push, atol=1e-6)


def test_the_sensor_feels_what_is_rendered_and_nothing_chatters() -> None:
    """Free motion, then a press that stays; links as believed, so that nothing else is felt at rest."""
    machine = loaded(("masses = 1.02", "masses = 1.0"))
    simulation = machine.config.simulation
    path = tuple(place for place in simulation.hand.path if float(place.at) < 8.3)
    hand = msgspec.structs.replace(simulation.hand, path=path)
    pressing = msgspec.structs.replace(
        machine.config, simulation=msgspec.structs.replace(simulation, hand=hand)
    )
    lockstep = Lockstep(build(replace(machine, config=pressing)))
    controller = lockstep.session.cycle.machine.controller
    limit, before, steps = np.array(described().rhi.motors.torque), None, []
    for _ in range(12_000):
        lockstep.tick()
        if lockstep.mode is Mode.ACTIVE:
            if before is not None:
                steps.append(float(np.max(np.abs(controller.torque - before) / limit)))
            before = controller.torque.copy()
    assert lockstep.mode is Mode.ACTIVE
    felt = lockstep.plant.arm.hold.wrench * METRES
    rendered = controller.alpha * np.array(lockstep.session.cycle.machine._demand)
    assert rendered[2] > 15.0
    # what the wire rounds of torques, thousandths of their rated ones, is all that is between them
    rounded = np.abs(np.linalg.pinv(controller.arm.J.T)) @ (0.5e-3 * limit)
    assert (np.abs(felt + rendered) < rounded + 0.1).all(), (felt + rendered, rounded)
    assert max(steps) < 0.02


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
def test_random_hands_that_turn_stop_nothing_and_get_nothing_back(resolution: str) -> None:
    machine = loaded(('resolution = "projection"', f'resolution = "{resolution}"'))
    found = session(machine, 2, 6.0, Temper(30.0, 5.0, 0.5))
    assert not found.stop, found.detail
    assert found.returned < 0.02


def test_directions_that_no_hand_has_are_refused() -> None:
    with pytest.raises(ModelError, match="x, y, z, rx"):
        RedundantArm(ROBOT, "handle", ("x", "y", "rz"), np.eye(7), ROTOR)
