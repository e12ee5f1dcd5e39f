"""Wrong measurements in closed loop: what is done about them, how soon, and what the plant does meanwhile."""

from collections.abc import Callable
from math import nan

import numpy as np
import pytest
from hapticd.runtime.core.modes import Command, Mode
from hapticd.safety.observation import Thresholds
from hapticd.sim.axis_drive import SimAxisDrive
from hapticd.sim.drive import SimDrive
from hapticd.testing.copies import in_a_copy
from hapticd.testing.energy import Energy

from .conftest import Bench

WIRE = 2
"""Ticks from the plant's sample to the tick that reads it."""


def joint(bench: Bench) -> object:
    return bench.joints[1]


def offset(bench: Bench, field: str, by: float, samples: int = 1 << 30) -> None:
    """An encoder of a moving joint is off, from now on or for some samples."""
    node, left = joint(bench), samples

    def change() -> None:
        nonlocal left
        if left > 0:
            left -= 1
            setattr(node, field, getattr(node, field) + by)

    bench.after_sensing(change)


def freeze(bench: Bench, *fields: str) -> None:
    node = joint(bench)
    kept = {field: getattr(node, field) for field in fields}
    bench.after_sensing(lambda: [setattr(node, field, value) for field, value in kept.items()])


def fastest(bench: Bench) -> float:
    """Speed of the fastest axis, as a share of the speed that stops."""
    speeds = [*bench.plant.arm.qd, *getattr(getattr(bench.plant, "ppu", None), "velocity", [])]
    thresholds: Thresholds = bench.cycle.machine.thresholds
    return max(abs(v) / most for v, most in zip(speeds, thresholds.speed, strict=True))


def detected(bench: Bench, within: int) -> None:
    for _ in range(WIRE + within):
        if bench.mode is not Mode.ACTIVE:
            return
        bench.run(1)
    assert bench.mode is not Mode.ACTIVE, f"not detected within {within} ticks"


def comes_to_rest_without_speeding_up(bench: Bench) -> None:
    before = fastest(bench)
    peak = 0.0
    for _ in range(450):
        bench.run(1)
        peak = max(peak, fastest(bench))
    assert peak < before + 0.06  # the brake of a joint stops its rotor at once: its link swings on the spring
    assert bench.mode is Mode.STOPPED and bench.safe
    bench.run(150)
    swing = 0.0
    for _ in range(100):  # more than a swing of the slowest spring: an instant may be where it turns
        bench.run(1)
        swing = max(swing, fastest(bench))
    assert swing < 0.06  # the hand goes on pulling at the springs


@pytest.mark.parametrize("field", ["position", "link_position", "velocity"])
def test_one_wrong_sample_of_an_encoder_is_replaced_and_changes_nothing(moving: Bench, field: str) -> None:
    wrong = 10.0 if field == "velocity" else 0.1
    before = moving.torques
    offset(moving, field, wrong, samples=1)
    for _ in range(5):
        moving.run(1)
        limits = [axis.command for axis in moving.cycle.machine.axes]
        steps = np.abs(np.subtract(moving.torques, before)) / limits[: len(before)]
        assert steps.max() < 0.04
    moving.run(100)
    assert moving.mode is Mode.ACTIVE


@pytest.mark.parametrize("field", ["position", "link_position", "velocity"])
@pytest.mark.parametrize("samples", [2, 1 << 30])
def test_the_second_wrong_sample_stops(moving: Bench, field: str, samples: int) -> None:
    offset(moving, field, 20.0 if field == "velocity" else 0.1, samples)
    detected(moving, 2)
    assert moving.reason == "encoder_jump"
    comes_to_rest_without_speeding_up(moving)


FROZEN = {
    "motor": ("position", "velocity"),
    "link": ("link_position",),
    "all of a joint": ("position", "velocity", "link_position"),
    "position": ("position",),
}


@pytest.mark.parametrize("name", FROZEN)
def test_an_encoder_that_freezes_while_its_joint_moves_stops(moving: Bench, name: str) -> None:
    fields = FROZEN[name]
    freeze(moving, *fields)
    detected(moving, 20)
    assert moving.reason in ("encoder_frozen", "encoder_mismatch", "velocity_mismatch")
    comes_to_rest_without_speeding_up(moving)


WRONG_VELOCITY: dict[str, Callable[[float], float]] = {
    "turned over": lambda v: -v,
    "doubled": lambda v: 2.0 * v,
    "zero": lambda v: 0.0,
}


def fastest_axis(bench: Bench) -> SimDrive:
    drives, most = bench.nodes.of(SimDrive), bench.cycle.machine.thresholds.speed
    return max(zip(drives, most, strict=True), key=lambda axis: abs(axis[0].velocity) / axis[1])[0]


@pytest.mark.parametrize("machine", ["giant"])  # the other moves too slowly here for a contradiction
@pytest.mark.parametrize("wrong", WRONG_VELOCITY)
def test_a_velocity_that_contradicts_the_change_of_position_stops_without_that_axis(
    moving: Bench, wrong: str
) -> None:
    drive = fastest_axis(moving)
    moving.after_sensing(lambda: setattr(drive, "velocity", WRONG_VELOCITY[wrong](drive.velocity)))
    detected(moving, 20)
    assert moving.reason == "velocity_mismatch"
    moving.run(2)
    assert not drive.powered and drive.brake
    comes_to_rest_without_speeding_up(moving)


FAST = {"giant": (13_000, 0.9), "rhi": (11_000, 0.04)}
"""Ticks of the walk at which a stop with a wrong velocity costs most, and what springs may give there [J]."""


def test_a_velocity_that_is_turned_over_in_a_stop_gives_no_energy(machine: str) -> None:
    bench, (tick, most) = Bench(machine=machine), FAST[machine]
    bench.run(tick)
    for joint in range(4):
        turns_over(bench, joint, most)


@in_a_copy
def turns_over(bench: Bench, joint: int, most: float) -> None:
    drive = bench.joints[joint]
    bench.after_sensing(lambda: setattr(drive, "velocity", -drive.velocity))
    bench.run(1, Command.STOP)
    energy, given = Energy(bench.plant), 0.0
    before = energy.kinetic
    for _ in range(400):
        bench.run(1)
        energy.take(1e-3)
        given = max(given, energy.kinetic - before - energy.hand - energy.gravity - energy.lifted)
    assert given < most
    assert bench.mode is Mode.STOPPED


@pytest.mark.parametrize("machine", ["giant"])
def test_encoders_that_are_frozen_at_rest_are_found_when_torque_acts(engaging: Bench) -> None:
    joint(engaging).velocity = 0.0  # type: ignore[attr-defined]
    freeze(engaging, "position", "velocity", "link_position")
    machine = engaging.cycle.machine
    update = machine.update

    def pushed(gain: float, trust: float) -> None:
        update(gain, trust)
        machine.commands[1] += 0.15 * machine.axes[1].command

    machine.update = pushed  # type: ignore[method-assign]
    for _ in range(20 + WIRE + 1):
        engaging.run(1)
    assert engaging.reason in ("encoder_frozen", "encoder_mismatch")


@pytest.mark.parametrize("machine", ["giant"])
@pytest.mark.parametrize("axis", ["ppu_x", "ppu_y"])
def test_a_frozen_encoder_of_the_gantry_stops(moving: Bench, axis: str) -> None:
    node = moving.nodes[axis]
    kept = node.position, node.velocity
    moving.after_sensing(lambda: [setattr(node, "position", kept[0]), setattr(node, "velocity", kept[1])])
    detected(moving, 20)
    assert moving.reason in ("encoder_frozen", "velocity_mismatch")
    comes_to_rest_without_speeding_up(moving)


@pytest.mark.parametrize("field", ["position", "link_position"])
def test_an_encoder_that_creeps_away_from_the_other_stops(moving: Bench, field: str) -> None:
    creep, node = 0.0, joint(moving)

    def change() -> None:
        nonlocal creep
        creep += 1e-3  # less than a jump
        setattr(node, field, getattr(node, field) + creep)

    tolerance = 0.025 if moving.cycle.machine.state.names[0] == "q" else 0.1 * 260.0 / 15000.0
    moving.after_sensing(change)
    detected(moving, round(tolerance / 1e-3) + 1 + 10)
    assert moving.reason in ("encoder_mismatch", "velocity_mismatch")
    comes_to_rest_without_speeding_up(moving)


@pytest.mark.parametrize("machine", ["giant"])
def test_a_torque_sensor_that_contradicts_the_spring_stops(moving: Bench) -> None:
    offset(moving, "load_torque", 35.0)
    detected(moving, 10)
    assert moving.reason == "encoder_mismatch"


SILENT: dict[str, Callable[[Bench], object]] = {
    "no number": lambda b: b.break_sensor("force_torque", "wrench", [nan] * 6),
    "saturated": lambda b: b.break_sensor("force_torque", "wrench", [1e4] * 6),
    "silent": lambda b: setattr(b.nodes["force_torque"], "silent", True),
}


@pytest.mark.parametrize("name", SILENT)
def test_a_wrench_that_is_none_begins_to_fade_in_its_first_tick(moving: Bench, name: str) -> None:
    assert moving.cycle.senses.trust == 1.0
    SILENT[name](moving)
    moving.run(WIRE + 1)
    assert 0.85 < moving.cycle.senses.trust < 1.0
    moving.run(20)
    assert moving.mode >= Mode.STOPPING


@pytest.mark.parametrize(("node", "field"), [("force_torque", "wrench"), ("imu_carriage", "acceleration")])
@pytest.mark.parametrize("machine", ["giant"])
def test_a_sensor_that_jumps_within_its_scale_is_not_believed_in_that_tick(
    moving: Bench, node: str, field: str
) -> None:
    torques = moving.torques
    values = list(getattr(moving.nodes[node], field))
    values[0] += 300.0 if node == "force_torque" else 25.0
    moving.break_sensor(node, field, values, samples=1)
    for _ in range(4):
        moving.run(1)
        assert np.abs(np.subtract(moving.torques, torques)).max() < 10.0
    moving.run(100)
    assert moving.mode is Mode.ACTIVE


def test_who_pulls_at_the_handle_cannot_start(machine: str) -> None:
    bench = Bench(('dead_man = [{ at = "0.3 s", pressed = true }]', "dead_man = []"), machine=machine)
    bench.run(200)
    force_torque, by = bench.nodes["force_torque"], {"giant": 30.0, "rhi": 10.0}[machine]
    held = True

    def pull() -> None:
        if held:
            force_torque.wrench = [force_torque.wrench[0] + by, *force_torque.wrench[1:]]

    bench.after_sensing(pull)
    bench.run(5)
    bench.press(True)
    bench.run(5)
    assert bench.mode is Mode.READY
    assert "the handle is pulled with" in bench.said[-1]
    held = False
    bench.press(False)
    bench.run(30)
    bench.press(True)
    bench.until(Mode.ENGAGING, limit=20)


@pytest.mark.parametrize("node", ["imu_carriage", "imu_handle"])
def test_an_accelerometer_that_shows_no_gravity_at_rest_forbids_to_start(node: str) -> None:
    bench = Bench()
    bench.run(200)
    bench.break_sensor(node, "acceleration", [0.0, 0.0, 8.0])
    bench.run(200)
    assert bench.mode is Mode.READY
    assert f"the {node[4:]}'s accelerometer shows 8.0 m/s^2 at rest" in bench.said[-1]


@pytest.mark.parametrize("machine", ["giant"])
@pytest.mark.parametrize("bit", [10, 12, 18, 24, 30])
@pytest.mark.parametrize("stopping", [False, True])
def test_flipped_bits_in_a_sample_of_the_gantry_speed_nothing_up(
    moving: Bench, bit: int, stopping: bool
) -> None:
    axis = moving.nodes.of(SimAxisDrive)[0]
    left = 1

    def flip() -> None:
        nonlocal left
        if left > 0:
            left -= 1
            axis.position += (1 << bit) * 1e-6

    if stopping:
        moving.run(1, Command.STOP)
    before = fastest(moving)
    moving.after_sensing(flip)
    for _ in range(100):
        moving.run(1)
        assert fastest(moving) < before + 0.03
    assert moving.mode is (Mode.STOPPING if stopping else Mode.ACTIVE)


def test_measurements_are_checked_while_nothing_has_power_too(machine: str) -> None:
    bench = Bench(('dead_man = [{ at = "0.3 s", pressed = true }]', "dead_man = []"), machine=machine)
    bench.run(200)
    offset(bench, "position", 0.2)
    bench.run(WIRE + 2)
    assert (bench.mode, bench.reason) == (Mode.STOPPED, "encoder_jump")
    bench.run(350)  # long enough for it to be believed again; the other encoder is not
    bench.run(600, Command.RESET)
    assert bench.mode is Mode.STOPPED
    assert "reset refused" in bench.said[-1] and "contradict" in bench.said[-1]
    bench.press(True)
    bench.run(5)
    assert bench.mode is Mode.STOPPED and bench.safe
    assert bench.said[-1].startswith("not started: a stop is latched; reset it first")


@pytest.mark.parametrize("machine", ["giant"])
@pytest.mark.parametrize("skipped", [1, 3, 6, 15])
def test_what_moves_on_while_ticks_are_skipped_has_not_jumped(moving: Bench, skipped: int) -> None:
    moving.run(300)
    assert max(map(abs, moving.plant.ppu.velocity)) > 0.4  # type: ignore[attr-defined]
    moving.run(1, skipped=skipped)
    moving.run(30)
    assert moving.mode is Mode.ACTIVE
    assert moving.reason == ""
