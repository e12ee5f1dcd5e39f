"""The cycle in closed loop with the simulated machine: starting, stopping, resetting, every reaction."""

from collections.abc import Callable
from math import inf, nan

import numpy as np
import pytest
from hapticd.devices.cia301 import AlState
from hapticd.runtime import cycle
from hapticd.runtime.giant.machine import Giant
from hapticd.runtime.modes import Command, Mode
from hapticd.runtime.outcome import outcome
from hapticd.runtime.rhi.machine import RedundantInterface
from hapticd.safety import Reaction, Verdict
from hapticd.sim import faults
from hapticd.sim.drives import SimDrive
from hapticd.sim.node import SimNode

from .conftest import MACHINES, Bench

RAMP_TICKS = 150  # detection and ramp together, the declared stop time


def test_a_session_comes_up_by_itself_and_waits_for_a_press(bench: Bench) -> None:
    bench.until(Mode.READY)
    bench.run(100)
    assert bench.mode is Mode.READY
    assert bench.safe
    assert not any(bench.torques)
    bench.until(Mode.ENABLING)
    assert bench.tick_index == pytest.approx(301, abs=3)  # the scripted press at 0.3 s
    bench.until(Mode.ENGAGING)
    assert not bench.safe


def test_engaging_fades_in_over_three_seconds_from_the_measured_posture(bench: Bench) -> None:
    bench.until(Mode.ENGAGING)
    gains = []
    posture = bench.plant.arm.q.copy()
    while bench.mode is Mode.ENGAGING:
        bench.run(1)
        gains.append(bench.memory.gain)
        if len(gains) < 100:
            assert np.abs(bench.plant.arm.q - posture).max() < 5e-3  # no jump
    assert len(gains) == pytest.approx(3000, abs=2)
    steps = np.diff(gains)
    assert (steps > 0.0).all() and (steps <= 1 / 3000 + 1e-12).all()
    assert bench.mode is Mode.ACTIVE


def test_a_joint_that_stands_beyond_its_limit_is_engaged_without_a_jump() -> None:
    bench = Bench(
        ('posture = "-0.9026 1.5724', 'posture = "-0.9026 2.412'),
        ('force = "150 N"', 'force = "0.1 N"'),  # a hand that hardly holds on
        ('torque = "12 N m"', 'torque = "0.01 N m"'),
    )
    bench.until(Mode.ENGAGING)
    fastest = 0.0
    for _ in range(100):
        bench.run(1)
        fastest = max(fastest, np.abs(bench.plant.arm.qd).max())
    assert bench.mode is Mode.ENGAGING
    assert fastest < 0.06  # what follows is prepositioning


def test_a_dead_man_held_from_the_start_does_not_arm(machine: str) -> None:
    bench = Bench(
        ('dead_man = [{ at = "0.3 s", pressed = true }]', 'dead_man = [{ at = "0 s", pressed = true }]'),
        machine=machine,
    )
    bench.run(600)
    assert bench.mode is Mode.READY
    bench.press(False)
    bench.run(5)
    bench.press(True)
    bench.run(5)
    assert bench.mode > Mode.READY


def test_one_channel_of_the_dead_man_is_no_press(bench: Bench) -> None:
    bench.until(Mode.READY)
    bench.plc.dead_man = (True, False)
    bench.run(50)
    assert bench.mode is Mode.READY


def _stand_outside(bench: Bench) -> None:
    """A joint is measured between its limit and the one that stops the machine."""
    sense, joint = bench.plant._sense, bench.joints[1]
    upper = bench.memory.machine.axes[1].upper + 1e-3

    def outside() -> None:
        sense()
        joint.link_position = upper

    bench.plant._sense = outside


REFUSALS: dict[str, tuple[Callable[[Bench], object], str]] = {
    # name: (what happens while the machine waits, why the press then starts nothing)
    "frames missing": (lambda b: setattr(b.joints[0], "tamper", faults.drop(4)), "not all devices answer"),
    "device not in OP": (lambda b: _fall(b.nodes["force_torque"]), "not all devices answer"),
    "drive fault": (lambda b: setattr(b.joints[2], "fault", 0x2310), "devices report an error; reset"),
    "e-stop": (lambda b: setattr(b.plc, "emergency_stop", (True, True)), "the emergency stop is pressed"),
    "scanner": (lambda b: setattr(b.plc, "scanner_clear", False), "in the scanned field"),
    "STO": (lambda b: setattr(b.plc, "_latched", True), "the safety PLC holds the torque off"),
    "no recorder": (lambda b: b.run(1, Command.UNRECORDED), "the recorder is gone"),
    "latched stop": (
        lambda b: b.memory.latch.take(Verdict(Reaction.HOLD, "test", "a test"), 0),
        "a stop is latched",
    ),
    "stale frames": (
        lambda b: setattr(b.joints[1], "tamper", lambda can_id, data: [(can_id, data)] * 8),
        "stale or repeated frames",
    ),
    "wrench is NaN": (lambda b: _break(b, "force_torque", "wrench", [nan] * 6), "gives nothing valid"),
    "joint outside": (_stand_outside, "stands outside its limits"),
}
GIANT_REFUSALS: dict[str, tuple[Callable[[Bench], object], str]] = {
    "carriage IMU is NaN": (
        lambda b: _break(b, "imu_carriage", "acceleration", [nan] * 3),
        "gives nothing valid",
    ),
}


@pytest.mark.parametrize(
    ("machine", "name"),
    [("giant", name) for name in (*REFUSALS, *GIANT_REFUSALS)] + [("rhi", "joint outside")],
)
def test_a_press_starts_nothing_while_something_is_amiss(bench: Bench, name: str) -> None:
    happen, why = {**REFUSALS, **GIANT_REFUSALS}[name]
    bench.until(Mode.READY)
    bench.run(5)
    happen(bench)
    bench.run(2)
    bench.press(True)
    bench.run(5)
    assert bench.mode is Mode.READY
    assert bench.safe
    (event,) = [event for event in bench.events if event.startswith("not started")]
    assert why in event


def test_a_stop_or_an_emergency_stop_of_a_waiting_machine_leaves_it_waiting(bench: Bench) -> None:
    bench.until(Mode.READY)
    bench.run(5, Command.STOP)
    bench.plc.emergency_stop = (True, True)
    bench.run(5)
    assert bench.mode is Mode.READY
    assert bench.reason == ""


def silence_all(bench: Bench) -> None:
    for node in bench.nodes.nodes:
        node.silent = True


def _fall(node: SimNode) -> None:
    """A device falls back to SAFEOP, reports no error, and goes on answering."""
    node._watchdog_tripped, node.al_state = True, AlState.SAFEOP


STOPS: dict[str, tuple[Callable[[Bench], object], str, bool, int]] = {
    # name: (what happens, reason, drives off at the end, ticks until it is detected)
    "dead-man released": (lambda b: b.press(False), "dead_man", True, 2),
    "one dead-man channel open": (lambda b: setattr(b.plc, "dead_man", (True, False)), "dead_man", True, 2),
    "e-stop": (lambda b: setattr(b.plc, "emergency_stop", (True, True)), "e_stop", True, 2),
    "one e-stop channel": (lambda b: setattr(b.plc, "emergency_stop", (True, False)), "e_stop", True, 2),
    "drive fault": (lambda b: setattr(b.joints[2], "fault", 0x2310), "device_fault", True, 3),
    "device silent": (lambda b: setattr(b.joints[1], "silent", True), "device_silent", True, 22),
    "all devices silent": (silence_all, "device_silent", True, 22),
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
    "device leaves OP": (lambda b: _fall(b.nodes["force_torque"]), "device_state", True, 3),
    "device restarts": (lambda b: b.joints[0].reset(), "device_state", True, 3),
    "drive in another mode": (lambda b: setattr(b.joints[2], "mode", 8), "drive_state", True, 3),
    "scanner": (lambda b: setattr(b.plc, "scanner_clear", False), "scanner", True, 2),
    "wrench is NaN": (lambda b: _break(b, "force_torque", "wrench", [nan] * 6), "wrench_lost", False, 25),
    "commanded stop": (lambda b: b.run(1, Command.STOP), "operator", True, 1),
}

GIANT_STOPS: dict[str, tuple[Callable[[Bench], object], str, bool, int]] = {
    # of sensors that only the giant has
    "handle IMU is NaN": (
        lambda b: _break(b, "imu_handle", "acceleration", [nan] * 3),
        "wrench_lost",
        False,
        25,
    ),
    "handle IMU is absurd": (
        lambda b: _break(b, "imu_handle", "acceleration", [1e30] * 3),
        "wrench_lost",
        False,
        25,
    ),
    "carriage IMU is NaN": (
        lambda b: _break(b, "imu_carriage", "acceleration", [nan] * 3),
        "acceleration_lost",
        False,
        25,
    ),
}


def _break(bench: Bench, node: str, field: str, value: object, samples: int = 1 << 30) -> None:
    """A sensor reports a value instead of what it measures, for some samples."""
    sense = bench.plant._sense
    left = samples

    def broken() -> None:
        nonlocal left
        sense()
        if left > 0:
            left -= 1
            setattr(bench.nodes[node], field, value)

    bench.plant._sense = broken


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
    assert engaging.memory.image.counters[13] >= 4  # misses are counted


def test_malformed_frames_are_dropped_and_counted(engaging: Bench) -> None:
    engaging.joints[3].tamper = faults.truncate(2)
    engaging.nodes["force_torque"].tamper = faults.corrupt(1, 0, 0xFF)
    engaging.run(100)
    assert engaging.mode is Mode.ENGAGING


def test_a_second_master_stops_the_machine(engaging: Bench) -> None:
    engaging.lockstep._bus.send(_frames((0x000, b"\x01\x00")))
    engaging.run(2)
    assert engaging.reason == "second_master"


def _frames(*frames: tuple[int, bytes]):  # type: ignore[no-untyped-def]
    from hapticd.devices.frames import Frames

    made = Frames()
    for can_id, data in frames:
        made.append(can_id, data)
    return made


def test_a_failed_solve_brakes_at_once_and_stops_on_the_third(
    engaging: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = engaging.memory.machine
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


@pytest.fixture
def moving(machine: str) -> Bench:
    """The hand walks, and the machine follows."""
    bench = Bench(machine=machine)
    bench.until(Mode.ACTIVE, limit=5000)
    bench.run(1500)
    assert np.abs(bench.plant.arm.qd).max() > 0.2
    return bench


@pytest.mark.parametrize(("machine", "node"), [("giant", "imu_carriage"), ("giant", "imu_handle")])
@pytest.mark.parametrize("value", [nan, inf, -1e30, 90.0])
def test_one_bad_sample_of_an_accelerometer_changes_nothing_for_good(
    moving: Bench, node: str, value: float
) -> None:
    before = moving.torques
    _break(moving, node, "acceleration", [value] * 3, samples=1)
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
    _break(moving, node, field, [1e30] * (6 if node == "force_torque" else 3))
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
    machine = moving.memory.machine
    monkeypatch.setattr(machine, "brake", lambda: False)  # never at rest
    _break(moving, "force_torque", "wrench", [nan] * 6)
    moving.run(24)
    assert moving.reason == "wrench_lost"
    slack = moving.memory.hold_limit
    assert slack - 30 < moving.until(Mode.STOPPED, limit=700) <= slack
    assert moving.reason == "stop_timeout"


@pytest.mark.parametrize("command", [nan, inf])
def test_a_command_that_is_no_number_never_reaches_a_drive(engaging: Bench, command: float) -> None:
    machine = engaging.memory.machine
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


def test_commands_beyond_the_limit_are_clamped_and_stop_after_ten(engaging: Bench) -> None:
    machine = engaging.memory.machine
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
    sense, joint = engaging.plant._sense, engaging.joints[1]
    measured = getattr(engaging.memory.machine.thresholds, limit)[1] + 0.05

    def beyond() -> None:
        sense()
        setattr(joint, quantity, measured)

    engaging.plant._sense = beyond  # type: ignore[method-assign]
    engaging.run(6)
    assert engaging.reason == "beyond_limit"


@pytest.mark.parametrize("machine", ["giant"])
def test_a_wrench_that_is_lost_fades_out_of_what_the_machine_feels(moving: Bench) -> None:
    machine = moving.memory.machine
    assert isinstance(machine, Giant)
    _break(moving, "force_torque", "wrench", [nan] * 6, samples=20)
    moving.run(2)  # the first of them is measured, and sent
    last = machine._estimator.wrench.copy()
    assert np.linalg.norm(last) > 1.0
    for tick in range(1, 21):
        moving.run(1)
        assert machine._felt == pytest.approx((1.0 - tick / 20) * last)
    moving.run(1)
    assert moving.mode is Mode.ACTIVE
    assert machine._felt == pytest.approx(machine._estimator.wrench)


def test_a_tick_without_commands_of_its_own_sends_none(
    engaging: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cycle, "_control", lambda *_: None)
    engaging.run(2)
    assert engaging.reason == "stale_output"
    assert not engaging.memory.image.word("joints.controlword").any()
    assert engaging.safe


def test_a_ramp_ends_with_its_time_even_where_nothing_comes_to_rest(
    engaging: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = engaging.lockstep.session.config
    ramp = round(0.8 * config.safety.stop_time * config.loop.rate)
    for _ in range(2):  # and a second one has as much
        with monkeypatch.context() as patch:
            patch.setattr(engaging.memory.machine, "brake", lambda: False)
            engaging.press(False)
            engaging.until(Mode.STOPPING)
            assert engaging.until(Mode.STOPPED) == ramp - 1  # the first in the tick of the stop
        engaging.run(10)
        engaging.run(50, Command.RESET)
        engaging.press(True)
        engaging.until(Mode.ENGAGING)


def test_a_stop_needs_a_reset_and_a_new_press(engaging: Bench) -> None:
    bench = engaging
    bench.press(False)
    bench.until(Mode.STOPPED)
    bench.press(True)  # holding it again is not enough
    bench.run(300)
    assert bench.mode is Mode.STOPPED
    bench.run(600, Command.RESET)  # and a reset with a held switch is refused (row 43)
    assert bench.mode is Mode.STOPPED
    assert any("release the dead-man" in event for event in bench.events)
    bench.press(False)
    bench.run(10)
    bench.run(50, Command.RESET)
    assert bench.mode is Mode.READY
    assert bench.safe
    bench.press(True)
    bench.until(Mode.ENGAGING)
    assert bench.memory.gain == 0.0  # and the wrench fades in from the beginning


@pytest.mark.parametrize("cause", ["e-stop", "drive fault", "all silent"])
def test_a_reset_with_the_cause_present_is_refused_and_works_once_it_is_gone(
    engaging: Bench, cause: str
) -> None:
    bench = engaging
    if cause == "e-stop":
        bench.plc.emergency_stop = (True, True)
    elif cause == "drive fault":
        bench.joints[2].fault = 0x2310
    else:
        silence_all(bench)
    bench.until(Mode.STOPPED, limit=300)
    bench.press(False)
    bench.run(10)
    bench.run(600, Command.RESET)
    assert bench.mode is Mode.STOPPED
    assert any("reset refused" in event for event in bench.events)
    assert bench.plc.request == 0
    bench.plc.emergency_stop = (False, False)
    for node in bench.nodes.nodes:
        node.silent = False
    for drive in bench.nodes.of(SimDrive):
        drive.fault = 0
    bench.run(10)
    bench.run(600, Command.RESET)
    assert bench.mode is Mode.READY, bench.events[-3:]
    assert bench.plc.request == 0
    bench.press(True)
    bench.until(Mode.ENGAGING)


def test_a_held_machine_switches_off_when_the_dead_man_opens(engaging: Bench) -> None:
    engaging.last_drive.tamper = faults.drop(6)
    engaging.until(Mode.HOLDING)
    engaging.run(200)
    assert not engaging.safe
    engaging.press(False)
    engaging.until(Mode.STOPPED, limit=RAMP_TICKS)
    engaging.run(2)
    assert engaging.safe
    assert engaging.reason == "dead_man"


def test_a_reset_of_a_held_machine_is_refused_and_changes_nothing(engaging: Bench) -> None:
    engaging.last_drive.tamper = faults.drop(6)
    engaging.until(Mode.HOLDING)
    engaging.run(50, Command.RESET)
    assert engaging.mode is Mode.HOLDING
    assert engaging.reason == "device_silent"
    assert not engaging.safe
    assert engaging.plc.request == 0
    assert any("release the dead-man switch first" in event for event in engaging.events)


def test_without_a_recorder_the_machine_goes_on_and_is_not_armed_again(engaging: Bench) -> None:
    engaging.run(1, Command.UNRECORDED)
    engaging.run(20)
    assert engaging.mode is Mode.ENGAGING
    engaging.press(False)
    engaging.until(Mode.STOPPED)
    engaging.run(50, Command.RESET)
    engaging.press(True)
    engaging.run(5)
    assert engaging.mode is Mode.READY
    assert any("recorder" in event for event in engaging.events)


@pytest.mark.parametrize("machine", ["giant"])  # the other one is at rest before the switch is seen
def test_an_emergency_stop_while_the_session_ends_is_what_the_session_ended_with(moving: Bench) -> None:
    moving.run(1, Command.END)
    assert moving.memory.stopped_by is None
    moving.plc.emergency_stop = (True, True)
    moving.run(5)
    stopped = moving.memory.stopped_by
    assert stopped is not None and stopped.verdict.reason == "e_stop"
    assert outcome(moving.memory, None).status == 3


def test_what_a_session_came_to(engaging: Bench) -> None:
    memory = engaging.memory
    assert outcome(memory, None).message.startswith("not at rest")
    engaging.run(1, Command.END)
    engaging.until(Mode.STOPPED)
    assert outcome(memory, None).status == 1
    assert "recorder" in outcome(memory, None).message
    assert outcome(memory, None, lost="the bus is gone").status == 3
    memory.mode = Mode.FAILED
    assert outcome(memory, None).status == 1


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


def test_a_daemon_that_sleeps_for_20_ms_finds_its_drives_safe_and_may_reset_them(engaging: Bench) -> None:
    engaging.run(1, skipped=25)
    engaging.run(3)
    assert engaging.safe
    assert engaging.mode >= Mode.STOPPING
    assert engaging.reason in ("sto", "device_fault", "device_state", "drive_state")
    engaging.press(False)
    engaging.until(Mode.STOPPED)
    engaging.run(50, Command.RESET)
    engaging.press(True)  # the watchdogs that acted have let go
    engaging.until(Mode.ENGAGING)


def test_arming_by_command_needs_the_command_before_the_press(machine: str) -> None:
    bench = Bench(
        ('by = "dead-man"', 'by = "command"'),
        ('dead_man = [{ at = "0.3 s", pressed = true }]', "dead_man = []"),
        machine=machine,
    )
    bench.until(Mode.READY)
    bench.press(True)
    bench.run(10)
    assert bench.mode is Mode.READY
    assert any("arming was not commanded" in event for event in bench.events)
    bench.press(False)
    bench.run(10)
    bench.run(10, Command.ARM)
    bench.press(True)
    bench.run(10)
    assert bench.mode > Mode.READY
    bench.press(False)  # a stop and its reset take the command back
    bench.until(Mode.STOPPED)
    bench.run(50, Command.RESET)
    bench.press(True)
    bench.run(10)
    assert bench.mode is Mode.READY
    assert bench.events[-1].startswith("not started: arming was not commanded")


def test_a_missing_device_fails_the_bring_up_without_moving_anything(bench: Bench) -> None:
    bench.joints[-1].silent = True
    bench.until(Mode.FAILED, limit=4000)
    name = bench.joints[-1].device.name
    assert any(name in event for event in bench.events)
    bench.run(50)
    assert bench.safe
    assert bench.mode is Mode.FAILED
    assert len(bench.lockstep.outputs.frames) == 0


def test_the_end_of_a_session_leaves_everything_safe(engaging: Bench) -> None:
    engaging.run(1, Command.END)
    engaging.until(Mode.STOPPED, limit=RAMP_TICKS)
    engaging.run(2)
    assert engaging.safe
    assert engaging.reason == "end"
