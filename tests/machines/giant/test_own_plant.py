"""A simulated giant that is not what its controller believes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hapticd.devices.cia301 import AlState
from hapticd.devices.cia402 import State
from hapticd.machines.giant.names import JOINTS
from hapticd.machines.giant.plant import GiantPlant
from hapticd.machines.giant.simulation import springs
from hapticd.machines.rendering.own_plant import own_friction, own_robot
from hapticd.machines.rendering.sections import Plant
from hapticd.models import Robot
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import Session, build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.errors import ConfigError
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay
from hapticd.sim.force_torque import SimForceTorque
from hapticd.sim.joint_drive import SimJointDrive

from .own_tables import OWN

OTHER = """
[simulation.plant]
masses = [1.2, 0.8, 1.1, 1, 0.9, 1.2]
rotor_inertia = 1.3
stiffness = [1.4, 0.7, 1, 1, 1, 0.7]
viscous_friction = 2
gear_friction = 0.02
load_friction = 0.05
bearing_friction = [0.001, 0.001, 0.001, 0.001, 0.001, 0.001]
delay = 1

[simulation.sensors.force]
bias = "0.2 N"
"""


def session(more: str) -> Session:
    loaded = config.load("giant")
    text = loaded.text.replace("substeps = 3", "substeps = 4").replace(OWN, "") + more
    parsed = config.parse(text, "giant.toml")
    return build(config.Loaded("giant", parsed, text, "giant.toml", loaded.model_text, loaded.model_source))


def plant_of(built: Session) -> GiantPlant:
    plant = Lockstep(built).plant
    assert isinstance(plant, GiantPlant)
    return plant


def test_the_plant_has_what_its_section_says_and_the_controller_does_not() -> None:
    believed, built = session(""), session(OTHER)
    own, usual = plant_of(built), plant_of(believed)
    q = usual.arm._robot.configuration(usual.arm.q)
    for joint, factor in zip(range(1, 7), (1.2, 0.8, 1.1, 1.0, 0.9, 1.2), strict=True):
        mine, theirs = (plant.arm._robot.model.inertias[joint] for plant in (own, usual))
        assert mine.mass == pytest.approx(factor * theirs.mass)
        np.testing.assert_allclose(mine.inertia, factor * theirs.inertia)
        np.testing.assert_allclose(mine.lever, theirs.lever)
    mass = [plant._robot.model.inertias[i].mass for plant in (own, usual) for i in (1, 2)]
    assert mass[:2] == mass[2:]  # the gantry's
    np.testing.assert_allclose(own.arm._robot.damping, 2.0 * usual.arm._robot.damping)
    np.testing.assert_allclose(own.arm._rotor, 1.3 * usual.arm._rotor)
    np.testing.assert_allclose(own.arm._stiffness / usual.arm._stiffness, [1.4, 0.7, 1, 1, 1, 0.7])
    M = [pin.crba(r.model, r.data, q) for r in (own.arm._robot, usual.arm._robot)]
    assert not np.allclose(*M)
    # of the controller, nothing has changed
    assert built.robot.model.inertias[3].mass == believed.robot.model.inertias[3].mass


def test_friction_is_a_share_of_what_the_model_says_that_joints_can() -> None:
    loaded = config.load("giant")
    robot = Robot.from_urdf(loaded.model_text, "giant.urdf").without(["ppu_x", "ppu_y"])
    friction = own_friction(robot, Plant(gear_friction=0.02, bearing_friction=(0.1,) * 6, load_friction=0.3))
    np.testing.assert_allclose(friction.gear, 0.02 * robot.effort)
    np.testing.assert_allclose(friction.bearing, 0.1 * robot.effort)
    np.testing.assert_allclose(friction.share, 0.3)


def test_without_the_section_the_plant_is_what_the_controller_believes_to_the_bit() -> None:
    loaded = config.load("giant")
    robot = Robot.from_urdf(loaded.model_text, "giant.urdf")
    own = own_robot(robot, JOINTS, Plant())
    for mine, theirs in zip(own.model.inertias, robot.model.inertias, strict=True):
        assert mine.mass == theirs.mass and np.array_equal(mine.inertia, theirs.inertia)
    np.testing.assert_array_equal(own.damping, robot.damping)
    believed = session("").config
    rotor, stiffness = springs(believed)  # type: ignore[arg-type]
    tracking = believed.giant.tracking  # type: ignore[attr-defined]
    assert rotor.tolist() == list(tracking.rotor_inertia) and stiffness.tolist() == list(tracking.stiffness)


def test_drives_obey_late() -> None:
    prompt, late = plant_of(session("")), plant_of(session("\n[simulation.plant]\ndelay = 3\n"))
    for plant in (prompt, late):
        plant._plc.latched = False
        for drive in plant.nodes.of(SimJointDrive):
            drive.al_state, drive.state, drive.mode = AlState.OP, State.OPERATION_ENABLED, drive.own_mode
            drive.target_torque = 10.0
    seen: list[list[float]] = [[], []]
    for _ in range(5):
        for plant, torques in zip((prompt, late), seen, strict=True):
            plant.step(1e-3)
            torques.append(float(plant.arm._torque[0]))
    assert seen == [[10.0] * 5, [0.0] * 3 + [10.0] * 2]


def test_the_devices_measure_with_the_errors_of_the_section() -> None:
    silent = '\n[simulation.sensors.load_torque]\nnoise = "0 N m"\n'
    true, biased = plant_of(session(silent)), plant_of(session(silent + OTHER.partition("delay = 1")[2]))
    said = [np.array(plant.nodes.of(SimForceTorque)[0].wrench) for plant in (biased, true)]
    difference = said[0] - said[1]
    assert np.all(difference[:3] != 0.0) and np.abs(difference[:3]).max() <= 0.2
    np.testing.assert_array_equal(difference[3:], 0.0)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("[simulation.plant]\nmasses = [1.0, 2.0]", "2 numbers for 6 joints"),
        ("[simulation.plant]\nmasses = 0.01", "masses"),
        ("[simulation.plant]\ndelay = 21", "delay"),
        ("[simulation.plant]\nstiffness = 10\nmasses = 0.3", "too few for springs"),
        ("[simulation.plant]\nmasses = 10", "brake_torque"),
        ('[simulation.sensors.force]\nbias = "0.2 N m"', "not a unit of force"),
        ("[simulation.sensors.load_torque]\ncoupling = 0.1", "coupling"),
    ],
)
def test_a_plant_that_cannot_be_is_an_error_at_its_line(more: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        session("\n" + more + "\n")


def test_energy_changes_by_the_work_of_hand_motors_friction_and_gantry() -> None:
    lockstep = Lockstep(session(OTHER))
    plant = lockstep.plant
    assert isinstance(plant, GiantPlant)

    def total() -> float:
        now = plant.energies()
        return now.kinetic + now.stored + now.potential

    lockstep.run(3000)
    start, before, carried, worst = total(), plant.arm.work, 0.0, 0.0
    force, velocity = plant.ppu_force, np.array(plant.ppu.velocity)
    flow = 0.0
    for _ in range(3500):
        lockstep.tick()
        last, velocity = velocity, np.array(plant.ppu.velocity)
        # the gantry and, through it, the hand work on what moves with it
        force = plant.ppu_force
        step = 1e-3 * float((force + plant._wrench[:2]) @ (velocity + last)) / 2
        carried, flow = carried + step, flow + abs(step)
        now = plant.arm.work
        done = [getattr(now, key) - getattr(before, key) for key in ("motors", "hand", "dry", "damping")]
        worst = max(worst, abs(total() - start - carried - sum(done)))
        assert done[2] <= 1e-9
    assert worst < 0.05
    assert flow > 5.0 and done[2] < -1.0 and done[0] > 5.0


def estimating() -> config.Loaded:
    """The giant whose estimator are Kalman filters."""
    loaded = config.load("giant")
    text = loaded.text.replace("[giant.tracking]\n", '[giant.tracking]\nestimation = "kalman"\n')
    parsed = config.parse(text, "giant.toml")
    return config.Loaded("giant", parsed, text, "giant.toml", loaded.model_text, loaded.model_source)


def test_motors_follow_what_a_kalman_filter_says_of_them_where_that_is_asked_for() -> None:
    built = build(estimating())
    lockstep = Lockstep(built)
    for _ in range(4500):
        lockstep.tick()
    plant = lockstep.plant
    assert isinstance(plant, GiantPlant)
    estimate = built.cycle.machine.kalman
    assert lockstep.mode is Mode.ACTIVE
    assert np.abs(plant.arm.motor_rate).max() > 0.02
    np.testing.assert_allclose(estimate.motor_rate, plant.arm.motor_rate, atol=0.02)
    np.testing.assert_allclose(estimate.link, plant.arm.q, atol=5e-3)  # it moves on meanwhile
    assert estimate.sensed and np.abs(estimate.bias).max() < 0.2
    np.testing.assert_allclose(estimate.link_rate, plant.arm.qd, atol=0.02)
    logged = built.cycle.machine.state.names
    assert logged and {"link_rate", "link_acceleration"} <= set(logged)


def test_a_session_with_the_handles_inertial_unit_replays_to_the_bit(tmp_path: Path) -> None:
    path = tmp_path / "kalman.mcap"
    lockstep_run.run(estimating(), path, 3.8, False)
    log = open_log(str(path))
    moved = [np.array(record.fixed["state"]["link_rate"]) for record in log.records()]
    assert np.abs(moved).max() > 0.02
    found = replay(log)
    assert found.differing_ticks == 0 and found.ticks == len(moved)
