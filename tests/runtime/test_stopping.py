"""The cycle in closed loop with the simulated machine: what stops it, how fast and why."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import inf, nan, sin

import numpy as np
import pytest
from hapticd.devices.frames import Frames
from hapticd.devices.image import COUNTERS
from hapticd.machines.giant.machine import Giant
from hapticd.machines.rhi.machine import RedundantInterface
from hapticd.runtime.core.modes import Command, Mode
from hapticd.safety import PASS, Monitor
from hapticd.safety.gate import CLAMPS_BEFORE_HOLD
from hapticd.sim import faults
from hapticd.sim.joint_drive import SimJointDrive
from hapticd.sim.person import Deed
from hapticd.testing.bench import fall

from ..machines.giant.own_tables import FED, OWN
from .conftest import MACHINES, RAMP_TICKS, Bench

STOPS: dict[str, tuple[Callable[[Bench], object], str, bool, int]] = {
    # name: (what happens, reason, drives off at the end, ticks until it is detected)
    "dead-man released": (lambda b: b.press(False), "dead_man", True, 2),
    "one dead-man channel open": (lambda b: setattr(b.plc, "dead_man", (True, False)), "dead_man", True, 2),
    "e-stop": (lambda b: setattr(b.plc, "emergency_stop", (True, True)), "e_stop", True, 2),
    "one e-stop channel": (lambda b: setattr(b.plc, "emergency_stop", (True, False)), "e_stop", True, 2),
    "drive fault": (lambda b: setattr(b.joints[2], "fault", 0x2310), "device_fault", True, 3),
    "device silent": (lambda b: setattr(b.joints[1], "silent", True), "device_silent", True, 22),
    "all devices silent": (Bench.silence_all, "device_silent", True, 22),
    "five frames lost": (
        lambda b: setattr(b.last_drive, "tamper", faults.drop(6)),
        "device_silent",
        False,
        7,
    ),
    "stale frames": (
        lambda b: setattr(b.joints[-2], "tamper", faults.duplicate(8)),
        "stale_frames",
        False,
        9,
    ),
    "device leaves OP": (lambda b: fall(b.nodes["force_torque"]), "device_state", True, 3),
    "device restarts": (lambda b: b.joints[0].reset(), "device_state", True, 3),
    "drive in another mode": (lambda b: setattr(b.joints[2], "mode", 8), "drive_state", True, 3),
    "wrench is NaN": (
        lambda b: b.break_sensor("force_torque", "wrench", [nan] * 6),
        "wrench_lost",
        False,
        25,
    ),
    "commanded stop": (lambda b: b.run(1, Command.STOP), "operator", True, 1),
}

GIANT_STOPS: dict[str, tuple[Callable[[Bench], object], str, bool, int]] = {
    # of sensors that only the giant has
    "handle IMU is NaN": (
        lambda b: b.break_sensor("imu_handle", "acceleration", [nan] * 3),
        "wrench_lost",
        False,
        25,
    ),
    "handle IMU is absurd": (
        lambda b: b.break_sensor("imu_handle", "acceleration", [1e30] * 3),
        "wrench_lost",
        False,
        25,
    ),
    "carriage IMU is NaN": (
        lambda b: b.break_sensor("imu_carriage", "acceleration", [nan] * 3),
        "acceleration_lost",
        False,
        25,
    ),
}


CASES = [(machine, name) for machine in MACHINES for name in STOPS] + [
    ("giant", name) for name in GIANT_STOPS
]


@pytest.mark.parametrize(("machine", "name"), CASES)
def test_a_fault_stops_the_machine_in_time_latched_and_with_its_reason(engaging: Bench, name: str) -> None:
    happen, reason, off, detect = {**STOPS, **GIANT_STOPS}[name]
    bench = engaging
    happen(bench)
    for _ in range(detect):
        bench.run(1)
        if bench.mode >= Mode.STOPPING:
            break
    assert bench.mode >= Mode.STOPPING, f"not detected within {detect} ticks"
    took = bench.until(Mode.STOPPED, Mode.HOLDING, limit=RAMP_TICKS)
    assert took <= RAMP_TICKS
    bench.run(30)
    assert bench.reason == reason
    assert (bench.mode is Mode.STOPPED) == off
    assert bench.safe == off
    assert np.abs(bench.plant.arm.qd).max() < 0.05
    bench.run(200)
    assert bench.mode in (Mode.STOPPED, Mode.HOLDING)  # latched


def drift(joint: SimJointDrive, ticks: Iterator[int]) -> None:
    """What the joint measures moves with 0.3 rad/s."""
    moved = 0.3e-3 * next(ticks)
    joint.velocity = 0.3
    joint.position += moved
    joint.link_position += moved


@pytest.mark.parametrize("name", ["dead-man released", "drive fault", "five frames lost", "commanded stop"])
def test_a_stop_while_drives_switch_on_takes_them_off_again_and_enables_none(bench: Bench, name: str) -> None:
    slow = bench.joints[0]
    slow.deaf = True
    bench.until(Mode.ENABLING)
    bench.after_sensing(partial(drift, slow, itertools.count(1)))  # nothing looks at rest
    bench.run(10)
    happen, reason, _, detect = STOPS[name]
    happen(bench)
    bench.until(Mode.STOPPED, limit=detect + 1)
    assert bench.reason == reason
    bench.run(3)
    assert bench.safe


def test_an_emergency_stop_takes_the_torque_in_the_same_tick(engaging: Bench) -> None:
    engaging.plc.emergency_stop = (True, True)
    engaging.run(3)
    assert engaging.mode is Mode.STOPPED
    assert engaging.safe
    assert engaging.plc.sto


def test_up_to_four_lost_frames_stop_nothing(engaging: Bench) -> None:
    engaging.joints[3].tamper = faults.drop(4)
    engaging.run(200)
    assert engaging.mode is Mode.ENGAGING
    assert counted(engaging, "misses") >= 4


def test_malformed_frames_are_dropped_and_counted(engaging: Bench) -> None:
    engaging.joints[3].tamper = faults.truncate(2)
    engaging.nodes["force_torque"].tamper = faults.corrupt(1, 0, 0xFF)
    engaging.run(100)
    assert engaging.mode is Mode.ENGAGING
    assert counted(engaging, "length") == 2
    assert counted(engaging, "ahead") == 1  # the corrupted sequence number
    assert counted(engaging, "misses") == 3


def counted(bench: Bench, event: str) -> int:
    return int(bench.cycle.image.counters[COUNTERS.index(event)])


def test_a_second_master_stops_the_machine(engaging: Bench) -> None:
    frames = Frames()
    frames.append(0x000, b"\x01\x00")
    engaging.lockstep._bus.send(frames)
    engaging.run(2)
    assert engaging.reason == "second_master"


def test_a_failed_solve_brakes_at_once_and_stops_on_the_third(
    engaging: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = engaging.cycle.machine
    if isinstance(machine, Giant):
        control = machine.force_control
        monkeypatch.setattr(control, "optimise", lambda: (control.brake(), False)[1])
    else:
        assert isinstance(machine, RedundantInterface)
        monkeypatch.setattr(machine.controller.resolution, "resolve", lambda part, gain: False)
    engaging.run(2)
    assert engaging.mode is Mode.ENGAGING
    engaging.run(2)
    assert engaging.reason == "solve_failed"
    engaging.until(Mode.HOLDING, limit=RAMP_TICKS)


@pytest.mark.parametrize(("machine", "node"), [("giant", "imu_carriage"), ("giant", "imu_handle")])
@pytest.mark.parametrize("value", [nan, inf, -1e30, 90.0])
def test_one_bad_sample_of_an_accelerometer_changes_nothing_for_good(
    moving: Bench, node: str, value: float
) -> None:
    before = moving.torques
    moving.break_sensor(node, "acceleration", [value] * 3, samples=1)
    for _ in range(5):
        moving.run(1)
        assert np.abs(np.subtract(moving.torques, before)).max() < 10.0
    moving.run(100)
    assert moving.mode is Mode.ACTIVE
    assert all(np.isfinite(moving.torques))


@pytest.mark.parametrize(
    ("machine", "node"),
    [("giant", "imu_carriage"), ("giant", "imu_handle"), ("giant", "force_torque"), ("rhi", "force_torque")],
)
def test_a_sensor_that_stays_broken_stops_the_moving_machine_without_a_lurch(
    moving: Bench, node: str
) -> None:
    field = "wrench" if node == "force_torque" else "acceleration"
    fastest = np.abs(moving.plant.arm.qd).max()
    moving.break_sensor(node, field, [1e30] * (6 if node == "force_torque" else 3))
    moving.run(25)
    assert moving.mode in (Mode.STOPPING, Mode.HOLDING)
    for _ in range(600):  # the gantry takes 0.4 s from full speed
        moving.run(1)
        assert np.abs(moving.plant.arm.qd).max() < 1.2 * fastest
    assert moving.mode is Mode.HOLDING
    assert np.abs(moving.plant.arm.qd).max() < 0.15  # the hand goes on pulling at the springs


def test_a_controlled_stop_that_does_not_come_to_rest_becomes_a_ramp_with_no_time_left(
    moving: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = moving.cycle.machine
    monkeypatch.setattr(machine, "brake", lambda dropped: False)  # never at rest
    moving.break_sensor("force_torque", "wrench", [nan] * 6)
    moving.run(24)
    assert moving.reason == "wrench_lost"
    slack = moving.cycle.stops.hold_limit
    assert slack - 30 < moving.until(Mode.STOPPED, limit=700) <= slack
    assert moving.reason == "stop_timeout"


def test_a_hand_that_never_lets_a_controlled_stop_come_to_rest_makes_it_a_ramp() -> None:
    bench = Bench(machine="rhi")
    bench.until(Mode.ACTIVE, limit=5000)
    bench.run(1500)

    class Shake:
        @staticmethod
        def at(time: float) -> tuple[list[float], list[float]]:
            return [0.46 + 0.02 * sin(60.0 * time), 0.02, 0.0], [0.0, 0.0, 0.0]

    hand = bench.plant.hand  # type: ignore[attr-defined]
    hand._course, hand._strength = Shake, 12.0
    bench.break_sensor("force_torque", "wrench", [nan] * 6)
    bench.until(Mode.STOPPING, limit=30)
    assert bench.reason == "wrench_lost"
    took = bench.until(Mode.STOPPED, limit=400)
    assert (bench.reason, bench.cycle.stops.latch.reaction.name) == ("stop_timeout", "RAMP")
    assert took <= bench.cycle.stops.ramp_limit + bench.cycle.stops.hold_limit
    bench.run(5)
    assert bench.safe


@pytest.mark.parametrize("command", [nan, inf])
def test_a_command_that_is_no_number_never_reaches_a_drive(engaging: Bench, command: float) -> None:
    machine = engaging.cycle.machine
    update = machine.update

    def broken(gain: float, trust: float) -> None:
        update(gain, trust)
        machine.commands[1] = command

    machine.update = broken  # type: ignore[method-assign]
    for _ in range(4):
        engaging.run(1)
        assert all(np.isfinite(engaging.torques))
    assert engaging.reason == "output_not_finite"
    engaging.run(2)  # there is nothing to ramp with
    assert engaging.mode is Mode.STOPPED
    assert engaging.safe
    assert engaging.plc.sto  # on request: nobody pressed anything


@pytest.mark.slow
def test_a_motor_that_gives_all_it_has_for_milliseconds_stops_nothing_at_a_high_rate() -> None:
    waypoint = 'at = "4.45 s"\nposition = "1.024 -0.6243 -1.05 m"\nangles = "45 60 0 deg"'
    roll = 'at = "4 s"\nposition = "0.6 -0.8 -1.05 m"\nangles = "-10 60 -90 deg"'
    printed = ('detection = "gauss"', 'detection = "redetect"')  # knows nothing of torques
    bench = Bench(('rate = "1 kHz"', 'rate = "4 kHz"'), (waypoint, roll), printed, (OWN, ""), (FED, ""))
    bench.run(14_000)
    longest = clamped = 0
    for _ in range(1000):
        before = bench.cycle.gate.clamps
        bench.run(1)
        clamped = clamped + 1 if bench.cycle.gate.clamps > before else 0
        longest = max(longest, clamped)
    assert longest > CLAMPS_BEFORE_HOLD  # joint 6 is rolled against its limit
    assert bench.mode is Mode.ACTIVE, bench.said


def test_commands_beyond_the_limit_are_clamped_and_stop_after_ten(engaging: Bench) -> None:
    machine = engaging.cycle.machine
    update = machine.update

    def broken(gain: float, trust: float) -> None:
        update(gain, trust)
        machine.commands[3] = 1e6

    machine.update = broken  # type: ignore[method-assign]
    engaging.run(9)
    assert engaging.mode is Mode.ENGAGING
    for torque, axis in zip(engaging.torques, machine.axes, strict=False):
        assert abs(torque) <= axis.command
    engaging.run(3)
    assert engaging.reason in ("output_beyond_limit", "beyond_limit")


@pytest.mark.parametrize(("quantity", "limit"), [("link_position", "upper"), ("velocity", "speed")])
def test_a_measured_position_or_speed_beyond_the_hard_limit_stops(
    engaging: Bench, quantity: str, limit: str
) -> None:
    thresholds = engaging.cycle.machine.thresholds
    measured = abs(getattr(engaging.joints[1], quantity))
    allowed = [*getattr(thresholds, limit)]
    allowed[1] = measured - 0.5  # a value that jumped there would be no measurement
    engaging.cycle.senses.monitor = Monitor(replace(thresholds, **{limit: tuple(allowed)}))
    engaging.run(6)
    assert engaging.reason == "beyond_limit"


@pytest.mark.parametrize("machine", ["giant"])
def test_a_wrench_that_is_lost_fades_out_of_what_the_machine_feels(moving: Bench) -> None:
    machine = moving.cycle.machine
    assert isinstance(machine, Giant)
    moving.break_sensor("force_torque", "wrench", [nan] * 6, samples=20)
    moving.run(2)  # the first of them is measured, and sent
    last = machine._estimator.wrench.copy()
    assert np.linalg.norm(last) > 1.0
    for tick in range(1, 21):
        moving.run(1)
        assert machine._rendering.felt == pytest.approx((1.0 - tick / 20) * last)
    for tick in range(1, 21):  # and comes back as it went
        moving.run(1)
        assert machine._rendering.felt == pytest.approx(tick / 20 * machine._estimator.wrench)
    assert moving.mode is Mode.ACTIVE


def test_a_tick_without_commands_of_its_own_sends_none(
    engaging: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engaging.cycle, "_command", lambda _: PASS)
    engaging.run(2)
    assert engaging.reason == "stale_output"
    assert not engaging.cycle.image.word("joints.controlword").any()
    assert engaging.safe


def test_a_ramp_ends_with_its_time_even_where_nothing_comes_to_rest(
    engaging: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = engaging.lockstep.session.config
    ramp = round(0.8 * config.safety.stop_time * config.loop.rate)
    engaging.plant.obey(Deed.RELEASE)  # the hand stays at the handle and pulls at nothing
    engaging.press(True)
    for _ in range(2):  # and a second one has as much
        with monkeypatch.context() as patch:
            patch.setattr(engaging.cycle.machine, "brake", lambda dropped: False)
            engaging.press(False)
            engaging.until(Mode.STOPPING)
            assert engaging.until(Mode.STOPPED) == ramp - 1  # the first in the tick of the stop
        engaging.run(10)
        engaging.run(200, Command.RESET)
        engaging.press(True)
        engaging.until(Mode.ENGAGING)
        engaging.run(10)  # a stop just as the drives get torque needs no ramp


@pytest.mark.parametrize(("policy", "mode"), [("record", Mode.ENGAGING), ("stop", Mode.HOLDING)])
def test_a_stall_of_12_ms_is_recorded_or_stops_as_the_configuration_says(
    policy: str, mode: Mode, machine: str
) -> None:
    bench = Bench(('on_overrun = "record"', f'on_overrun = "{policy}"'), machine=machine)
    bench.until(Mode.ENGAGING)
    bench.run(100)
    bench.run(1, skipped=12)
    bench.run(RAMP_TICKS)
    assert bench.mode is mode
