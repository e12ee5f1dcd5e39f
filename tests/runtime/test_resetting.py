"""The cycle in closed loop with the simulated machine: after a stop, and at the end."""

import pytest
from hapticd.devices.safety_plc import SafetyRequest
from hapticd.machines.rhi.machine import RedundantInterface
from hapticd.runtime.core.modes import Command, Mode
from hapticd.runtime.live.outcome import Ending, outcome
from hapticd.safety import Reaction
from hapticd.sim import faults
from hapticd.sim.drive import SimDrive
from hapticd.sim.person import Deed

from .conftest import RAMP_TICKS, Bench


def stay(bench: Bench) -> None:
    """A hand that the motors could not hold stays at the handle from now on; the switch is still pressed."""
    if isinstance(bench.cycle.machine, RedundantInterface):
        bench.plant.obey(Deed.RELEASE)
        bench.press(True)


def test_a_stop_needs_a_reset_and_a_new_press(engaging: Bench) -> None:
    bench = engaging
    stay(bench)
    bench.press(False)
    bench.until(Mode.STOPPED)
    bench.press(True)  # holding it again is not enough
    bench.run(300)
    assert bench.mode is Mode.STOPPED
    bench.run(600, Command.RESET)  # and a reset with a held switch is refused (row 43)
    assert bench.mode is Mode.STOPPED
    assert any("release the dead-man" in event for event in bench.said)
    bench.press(False)
    bench.run(10)
    bench.run(50, Command.RESET)
    assert bench.mode is Mode.READY
    assert bench.safe
    bench.press(True)
    bench.until(Mode.ENGAGING)
    assert bench.cycle.phase.gain == 0.0  # and the wrench fades in from the beginning


@pytest.mark.parametrize("cause", ["e-stop", "drive fault", "all silent"])
def test_a_reset_with_the_cause_present_is_refused_and_works_once_it_is_gone(
    engaging: Bench, cause: str
) -> None:
    bench = engaging
    stay(bench)
    if cause == "e-stop":
        bench.plc.emergency_stop = (True, True)
    elif cause == "drive fault":
        bench.joints[2].fault = 0x2310
    else:
        bench.silence_all()
    bench.until(Mode.STOPPED, limit=300)
    bench.press(False)
    bench.run(10)
    bench.run(600, Command.RESET)
    assert bench.mode is Mode.STOPPED
    assert any("reset refused" in event for event in bench.said)
    off = bench.cycle.stops.latch.reaction is Reaction.OFF
    assert bench.plc.request == (SafetyRequest.STO if off else 0)
    bench.plc.emergency_stop = (False, False)
    for node in bench.nodes.nodes:
        node.silent = False
    for drive in bench.nodes.of(SimDrive):
        drive.fault = 0
    bench.run(10)
    bench.run(600, Command.RESET)
    assert bench.mode is Mode.READY, bench.said[-3:]
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
    assert any("release the dead-man switch first" in event for event in engaging.said)


def test_without_a_recorder_the_machine_goes_on_and_is_not_armed_again(engaging: Bench) -> None:
    engaging.run(1, Command.UNRECORDED)
    engaging.run(20)
    assert engaging.mode is Mode.ENGAGING
    engaging.press(False)
    engaging.until(Mode.STOPPED)
    engaging.run(100)  # the arm settles
    engaging.run(50, Command.RESET)
    engaging.press(True)
    engaging.run(5)
    assert engaging.mode is Mode.READY
    assert any("recorder" in event for event in engaging.said)


@pytest.mark.parametrize("machine", ["giant"])  # the other one is at rest before the switch is seen
def test_an_emergency_stop_while_the_session_ends_is_what_the_session_ended_with(moving: Bench) -> None:
    moving.run(1, Command.END)
    assert moving.cycle.stops.last is None
    moving.plc.emergency_stop = (True, True)
    moving.run(5)
    stopped = moving.cycle.stops.last
    assert stopped is not None and stopped.verdict.reason == "e_stop"
    assert outcome(moving.cycle, None, Ending()).status == 3


def test_what_a_session_came_to(engaging: Bench) -> None:
    cycle = engaging.cycle
    assert outcome(cycle, None, Ending()).message.startswith("not at rest")
    engaging.run(1, Command.END)
    engaging.until(Mode.STOPPED)
    assert outcome(cycle, None, Ending()).message.startswith("not known to be off")  # they were told, no more
    engaging.run(3)
    assert outcome(cycle, None, Ending()).status == 1
    assert "recorder" in outcome(cycle, None, Ending()).message
    assert outcome(cycle, None, Ending(lost="the bus is gone")).status == 3
    cycle.phase.mode = Mode.FAILED
    assert outcome(cycle, None, Ending()).status == 1


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


def test_the_end_of_a_session_leaves_everything_safe(engaging: Bench) -> None:
    engaging.run(1, Command.END)
    engaging.until(Mode.STOPPED, limit=RAMP_TICKS)
    engaging.run(2)
    assert engaging.safe
    assert engaging.reason == "end"


def test_who_quits_before_the_devices_came_up_is_not_told_to_be_more_patient() -> None:
    bench = Bench()
    bench.run(1, Command.END)
    cycle = bench.cycle
    assert cycle.mode is Mode.BRINGUP
    assert outcome(cycle, None, Ending()).status == 1
    quit_by_hand = outcome(cycle, None, Ending(quit=True))
    assert (quit_by_hand.status, quit_by_hand.message) == (0, "quit before the devices had come up")
