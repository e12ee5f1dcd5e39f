"""Rules, tracking, stops and rest of the giant: their arithmetic, and one short session each."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from hapticd.experiments import giant_rest, giant_rules, giant_stops, giant_tracking
from hapticd.experiments.own_plant import own
from hapticd.hqp import Level
from hapticd.machines.giant.config import GiantConfig
from hapticd.machines.giant.names import PPU_JOINTS
from hapticd.machines.giant.plant import GiantPlant
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.sim.force_torque import SimForceTorque
from hapticd.sim.hand import Path
from hapticd.sim.imu import SimImu

GIANT = config.load("giant")
MOST = np.ones(2)


def quiet(_: str) -> None: ...


@pytest.mark.parametrize(
    ("x", "wanted", "explained"),
    [
        ((1.0, 0.5), (3.0, 0.5), True),  # pushed back by the limit that is reached
        ((0.5, 0.5), (3.0, 0.5), False),  # by one that is not
        ((1.0, 0.5), (0.2, 0.5), False),  # pulled by the one that is reached
    ],
)
def test_a_force_is_explained_by_limits_that_are_reached_and_push(
    x: tuple[float, float], wanted: tuple[float, float], explained: bool
) -> None:
    levels = [Level(C=np.eye(2), lb=-MOST, ub=MOST), Level(A=np.eye(2), b=np.array(wanted))]
    control: Any = SimpleNamespace(levels=levels, solution=SimpleNamespace(x=np.array(x)))
    assert giant_rules.explained(control, 1) is explained


def test_a_joint_that_stands_under_the_papers_rule_is_none_of_the_ratio() -> None:
    assert giant_rules.worst_ratio(np.array([2.0, 3.0, 0.5]), np.array([4.0, 2.0, 0.0])) == 1.5


def test_a_hand_in_free_space_feels_hardly_more_than_the_free_mass() -> None:
    found = giant_rules.session(GIANT, "gauss", "plant as believed", 5.4, quiet)
    assert found.stop == "" and found.unexplained == 0.0 and found.toggles[-1] == 0
    assert 0.01 < found.beyond < 1.5  # the mass itself takes 13 N
    assert (found.acceleration <= (25.0, 25.0, 35.0, 40.0, 60.0, 90.0)).all()
    assert (found.jerk > found.acceleration).all()


def test_lines_of_joints_are_their_own_and_tell_gain_and_delay() -> None:
    dt = 1e-3
    course = giant_tracking.fast_course(dt)
    t = 3.0 + dt * np.arange(round(giant_tracking.PERIOD / dt))
    led, _, acceleration = course.at(t)
    late, *_ = course.at(t - 2e-3)
    centre = np.array(giant_tracking.CENTRE)
    along = giant_tracking.Along(led, centre + 0.5 * (late - centre), acceleration)
    for joint in range(6):
        own = giant_tracking.lines(joint)
        expected = 0.5 * np.exp(-2j * np.pi * own * 2e-3)
        np.testing.assert_allclose(along.response(joint, 1.0 / dt), expected, rtol=1e-6)
        wave = np.exp(-2j * np.pi * np.outer(own, t))
        others = np.delete(led - centre, joint, axis=1)
        assert np.abs(wave @ others).max() < 1e-9 * len(t)
    assert np.abs(acceleration).max() < len(giant_tracking.WANTED) * giant_tracking.FAST


def test_a_link_follows_until_the_first_line_at_which_it_does_not() -> None:
    f = np.array([1.0, 2.0, 4.0, 8.0])
    weak = giant_tracking.following(f, np.array([1.0, 0.75, 0.7, 2.0], complex))
    assert weak == pytest.approx((2.0, 8.0, 6.02), rel=1e-3)  # -2.5 and -3.1 dB
    late = giant_tracking.following(f, np.exp(-0.25j * f))
    assert late == pytest.approx((8.0, 2.0, 0.0))  # 57 degrees at 4 Hz
    assert giant_tracking.following(f, np.full(4, -0.1 + 0j))[:2] == (0.0, 0.0)


@pytest.mark.parametrize("rigid", [False, True])
def test_plain_pd_is_two_gains_and_bears_the_arm_where_it_knows_it(rigid: bool) -> None:
    law = "PD with rigid body" if rigid else "PD"
    session = build(GIANT, controller=giant_tracking.LAWS[law][1])
    machine: Any = session.cycle.machine
    control, joints = machine.force_control, machine._joints
    q = np.array([0.3, 1.4, -0.5, 0.65, 0.5, 0.2])
    control.q[:], control.qd[:], control.qdd[:] = q, 0.0, 0.0
    joints.position[:], joints.velocity[:] = q - 1e-3, 0.1
    tracking = GIANT.config.giant.tracking  # type: ignore[attr-defined]
    expected = 1e-3 * np.array(tracking.p_gain) - 0.1 * np.array(tracking.d_gain)
    if rigid:  # at rest: the slope of the potential energy
        arm = session.robot.without(PPU_JOINTS)

        def potential(at: np.ndarray) -> float:
            return float(pin.computePotentialEnergy(arm.model, arm.data, arm.configuration(at)))

        steps = 1e-5 * np.eye(6)
        expected += [(potential(q + s) - potential(q - s)) / 2e-5 for s in steps]
    np.testing.assert_allclose(machine._law.torque(np.zeros(2)), expected, atol=1e-5)
    control.q += 1.0  # what is measured is a tick old: it belongs to where the links were led then
    np.testing.assert_allclose(machine._law.torque(np.zeros(2))[0], expected[0], atol=1e-5)


def test_kinds_of_limits_are_told_apart_by_their_names() -> None:
    found = giant_stops._kinds(
        {"joint 2": -0.1, "tilt (singularity)": 2e-3, "handle x": 3e-3, "elbow y": -1.0, "PPU x": 4e-3}
    )
    assert found == {"joints and tilt": 2e-3, "boxes": 3e-3, "PPU": 4e-3}
    assert giant_stops.worst([found, {**found, "PPU": 5e-3}]) == [2e-3, 3e-3, 5e-3]


@pytest.mark.parametrize(
    ("seed", "force"),
    [(3, 50.0), pytest.param(130089, 150.0, id="the hand hangs on the brake of a joint beyond its limit")],
)
def test_a_stop_under_a_random_hand_keeps_the_limits_and_a_new_press_works(seed: int, force: float) -> None:
    found = giant_stops.stopped(GIANT, seed, force)
    assert found.cause == "stop command (R2)" and found.speed > 0.1
    assert found.pressed, found.said
    for kind, most in giant_stops.LEAST.items():
        assert found.lies[kind] <= found.passed[kind] <= most


def test_the_hand_of_the_paused_walk_is_still_while_it_is_looked_at() -> None:
    assert isinstance(GIANT.config, GiantConfig)
    walk, begins = giant_rest.paused(GIANT.config)
    assert list(begins) == list(giant_rest.HELD_AT) and walk.simulation and GIANT.config.simulation
    points = walk.simulation.hand.path
    path = Path([float(p.at) for p in points], np.array([[*p.position, *p.angles] for p in points]))
    there = {float(p.at): [*p.position, *p.angles] for p in GIANT.config.simulation.hand.path}
    for limit, begin in begins.items():
        for t in begin + giant_rest.SETTLED_S + np.linspace(0.0, giant_rest.LOOKED_S, 5):
            place, rate = path.at(t)
            np.testing.assert_allclose(place, there[giant_rest.HELD_AT[limit]], atol=2e-4)
            assert np.abs(rate).max() < 1e-3


def test_joints_are_quiet_where_a_hand_presses_against_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    assert isinstance(GIANT.config, GiantConfig) and GIANT.config.simulation
    first = GIANT.config.simulation.hand.path[0]
    x, y, z = first.position
    lifted = (x, y, z + 0.14)
    path = [(0.0, first.position), (3.2, first.position), (4.4, lifted), (6.0, lifted)]
    points = tuple(msgspec.structs.replace(first, at=type(first.at)(t), position=place) for t, place in path)
    hand = msgspec.structs.replace(GIANT.config.simulation.hand, path=points)
    simulation = msgspec.structs.replace(GIANT.config.simulation, hand=hand)
    lifting = replace(GIANT, config=msgspec.structs.replace(GIANT.config, simulation=simulation))
    monkeypatch.setattr(giant_rest, "HELD_AT", {"joint 4": 4.4})
    (found,) = giant_rest.held(own(lifting, 1), ["joint 4"], quiet)
    assert found.stop == "" and found.at == 1.0 and found.force > 10.0
    assert found.acceleration.shape == (1000, 6)
    assert 1e-3 < found.restless.max() < 0.5


def test_what_wanders_is_told_from_what_trembles() -> None:
    t = np.arange(11_000) / 1000.0
    velocity = np.zeros((len(t), 6))
    velocity[:, 0] = 2e-3 + 0.1 * np.exp(-t) + 5e-3 * np.sin(2.0 * np.pi * 20.0 * t)
    velocity[:, 4] = 3e-3
    found = giant_rest.LetGo("both", giant_rest.WHEN[0], velocity, "")
    np.testing.assert_allclose(found.wander, (2e-3, 3e-3), atol=2e-5)
    assert found.speed == pytest.approx(7e-3, rel=1e-2)


def test_biases_are_what_the_sensors_show_too_much() -> None:
    plant = build(GIANT).plant()
    assert isinstance(plant, GiantPlant)
    (sensor,), units = plant.nodes.of(SimForceTorque), plant.nodes.of(SimImu)
    before = [np.array(sensor.wrench), *(np.array(unit.acceleration) for unit in units)]
    wrench, acceleration = np.arange(1.0, 7.0), np.array([0.1, -0.2, 0.3])
    giant_rest._bias(plant, wrench, acceleration)
    plant._noise[:] = 0.0
    plant._sense()
    np.testing.assert_allclose(np.array(sensor.wrench) - before[0], wrench, atol=0.2)
    for unit, truth in zip(units, before[1:], strict=True):
        np.testing.assert_allclose(np.array(unit.acceleration) - truth, acceleration, atol=0.1)


def test_motors_take_over_no_pull_at_a_start_that_only_the_sensor_shows() -> None:
    lockstep = Lockstep(build(GIANT))
    person = giant_stops.Person(lockstep)
    assert person.wait(6.0, person.mode(Mode.ACTIVE))
    person.press(False)
    assert person.wait(2.0, person.mode(Mode.STOPPED)) and person.reset()
    arm = person.plant.arm
    giant_rest._bias(person.plant, np.array([100.0, 100.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(3))
    person.wait(0.2)
    person.press(True)
    assert person.wait(2.0, person.mode(Mode.ENGAGING))
    there, most = arm.q.copy(), 0.0

    def watch() -> None:
        nonlocal most
        most = max(most, float(np.abs(arm.q - there).max()))

    person.wait(0.05, watch=watch)
    assert most < 0.014  # 13 mrad where it fades in, 17 where all of it is taken over
