"""The cycle in closed loop with the simulated machine: drives that do not do what they are told."""

import pytest
from hapticd.devices.cia402 import State
from hapticd.devices.safety_plc import SafetyRequest
from hapticd.runtime.core.drives import TRANSITION_DEADLINE_S
from hapticd.runtime.core.modes import Command, Mode
from hapticd.runtime.core.reset import RESET_DEADLINE_S
from hapticd.runtime.live.outcome import Ending, outcome
from hapticd.safety import Reaction
from hapticd.sim.drive import SimDrive
from hapticd.testing.bench import weld

from .conftest import Bench

DEADLINE = round(1e3 * TRANSITION_DEADLINE_S)
RESET = round(1e3 * RESET_DEADLINE_S)


def stopped(bench: Bench) -> None:
    bench.press(False)
    bench.until(Mode.STOPPED)


@pytest.mark.parametrize("after", [0, 1, 5])
def test_a_drive_that_does_not_switch_off_loses_its_torque_by_the_safety_plc(
    engaging: Bench, after: int
) -> None:
    drive = engaging.joints[1]
    weld(drive)
    stopped(engaging)
    engaging.run(after)
    assert drive.powered
    engaging.run(DEADLINE + 5)
    assert engaging.cycle.stops.latch.reaction is Reaction.OFF
    assert engaging.reason == "drive_state"
    assert engaging.plc.sto and engaging.plc.request == SafetyRequest.STO
    assert engaging.safe
    assert any(drive.device.name in event and "R4 drive_state" in event for event in engaging.said)


def test_as_long_as_a_drive_has_power_no_reset_clears_the_latch_or_lets_the_safety_plc_go(
    engaging: Bench,
) -> None:
    drive = engaging.joints[1]
    weld(drive)
    _always_on(engaging, drive)  # and it reports what it would do without STO
    stopped(engaging)
    engaging.run(DEADLINE // 2, Command.RESET)
    assert engaging.mode is Mode.STOPPED
    engaging.run(DEADLINE)
    engaging.events.clear()
    for _ in range(2 * RESET):
        engaging.run(1, Command.RESET if engaging.tick_index % RESET == 0 else Command.NONE)
        assert engaging.plc.sto
    assert engaging.mode is Mode.STOPPED
    assert engaging.cycle.stops.latch.reaction is Reaction.OFF
    assert any("reports operation enabled; it may have power" in event for event in engaging.said)
    engaging.press(True)
    engaging.run(50)
    assert engaging.mode is Mode.STOPPED and engaging.safe


def test_a_drive_that_does_not_answer_is_not_at_rest(engaging: Bench) -> None:
    drive = engaging.last_drive
    drive.silent = True
    engaging.until(Mode.STOPPED)
    engaging.press(False)
    engaging.run(100, Command.RESET)
    assert engaging.mode is Mode.STOPPED
    engaging.run(RESET)
    assert any(f"reset refused: {drive.device.name} does not answer" in event for event in engaging.said)
    assert engaging.cycle.stops.latch.reaction is Reaction.OFF  # who knows what it does
    drive.silent = False
    engaging.run(RESET, Command.RESET)
    assert engaging.mode is Mode.READY
    assert engaging.plc.request == 0 and not engaging.plc.sto


def test_a_drive_that_has_power_after_the_bring_up_is_switched_off_before_anything_is_ready(
    bench: Bench,
) -> None:
    bench.run(5)
    drive = bench.joints[-1]
    weld(drive)
    _always_on(bench, drive)
    for _ in range(2000):
        bench.run(1)
        assert bench.mode in (Mode.BRINGUP, Mode.STOPPED)
        if bench.mode is Mode.STOPPED:
            break
    bench.run(2)
    assert bench.cycle.stops.latch.reaction is Reaction.OFF
    assert bench.plc.sto
    assert any("R4 drive_state" in event and drive.device.name in event for event in bench.said)


def _always_on(bench: Bench, drive: SimDrive) -> None:
    """A drive whose power stage is on whenever it can be."""
    bench.after_sensing(lambda: setattr(drive, "state", State.OPERATION_ENABLED))


def test_a_drive_that_switches_itself_on_while_the_machine_waits_is_switched_off_and_latched(
    bench: Bench,
) -> None:
    bench.until(Mode.READY)
    bench.run(20)
    weld(bench.joints[0])
    bench.run(4)
    assert bench.mode is Mode.STOPPED
    assert (bench.reason, bench.cycle.stops.latch.reaction) == ("drive_state", Reaction.OFF)
    assert bench.plc.sto and bench.safe


def test_a_drive_whose_mode_is_wrong_is_refused_and_never_has_power(bench: Bench) -> None:
    bench.until(Mode.READY)
    bench.joints[1].mode = 8
    bench.press(True)
    states = set()
    for _ in range(100):
        bench.run(1)
        states |= {drive.state for drive in bench.joints}
    assert states == {State.SWITCH_ON_DISABLED}
    (event,) = [event for event in bench.said if event.startswith("not started")]
    assert f"{bench.joints[1].device.name} is in mode 8 (6061h) instead of" in event


def test_the_session_ends_when_the_drives_say_that_they_are_off_and_not_when_they_were_told(
    engaging: Bench,
) -> None:
    weld(engaging.joints[0])
    engaging.run(1, Command.END)
    engaging.until(Mode.STOPPED)
    for _ in range(DEADLINE - 5):
        engaging.run(1)
        assert not engaging.cycle.drives.secured
    message = outcome(engaging.cycle, None, Ending()).message
    assert message.startswith(f"not known to be off: {engaging.joints[0].device.name} reports operation")
    engaging.run(20)  # the safety PLC took its torque, and so it says
    assert engaging.cycle.drives.secured
    assert "R4 drive_state" in outcome(engaging.cycle, None, Ending()).message


@pytest.mark.parametrize("held", ["dead-man", "fault", "none"])
def test_an_sto_that_was_requested_stands_until_the_latch_lets_go(engaging: Bench, held: str) -> None:
    machine = engaging.cycle.machine
    update = machine.update

    def broken(gain: float, trust: float) -> None:
        update(gain, trust)
        machine.commands[1] = float("nan")

    machine.update = broken  # type: ignore[method-assign]
    engaging.until(Mode.STOPPED)
    engaging.run(5)
    assert engaging.cycle.stops.latch.reaction is Reaction.OFF
    if held != "dead-man":
        engaging.press(False)
    if held == "fault":
        engaging.joints[2].fault = 0x2310
    engaging.run(5)
    engaging.run(1, Command.RESET)
    for _ in range(RESET + 10):
        assert engaging.plc.sto or held == "none"
        if engaging.mode is Mode.STOPPED and not engaging.cycle.reset.acknowledging:
            assert engaging.plc.sto
        engaging.run(1)
    assert engaging.mode is (Mode.READY if held == "none" else Mode.STOPPED)
    assert engaging.plc.request == (0 if held == "none" else SafetyRequest.STO)
    assert engaging.plc.sto == (held != "none")


def test_an_acknowledgement_that_something_comes_between_is_taken_back(engaging: Bench) -> None:
    engaging.plc.emergency_stop = (True, True)
    engaging.until(Mode.STOPPED)
    engaging.press(False)
    engaging.plc.emergency_stop = (False, False)
    engaging.run(5, Command.RESET)
    while not engaging.cycle.reset.acknowledging:
        engaging.run(1)
    engaging.run(3)
    assert not engaging.plc.sto and engaging.mode is Mode.STOPPED
    engaging.press(True)  # somebody closes the switch before the latch has let go
    engaging.run(4)
    assert engaging.plc.sto and engaging.plc.request == SafetyRequest.STO
    engaging.run(RESET)
    assert engaging.mode is Mode.STOPPED
    assert any("release the dead-man switch first" in event for event in engaging.said)


def test_a_safety_plc_that_does_not_confirm_an_sto_is_told_to_people(engaging: Bench) -> None:
    engaging.plc.deaf = True
    weld(engaging.joints[0])
    stopped(engaging)
    engaging.run(3 * DEADLINE)
    assert engaging.cycle.stops.latch.reaction is Reaction.OFF and not engaging.plc.sto
    (event,) = [event for event in engaging.said if "does not confirm" in event]
    assert event == "the safety PLC does not confirm the STO: press the emergency stop"
    assert not engaging.cycle.drives.secured


def test_a_stop_breaks_a_reset_off(engaging: Bench) -> None:
    stopped(engaging)
    engaging.run(10)
    engaging.run(5, Command.RESET)
    engaging.run(100, Command.STOP)
    assert engaging.mode is Mode.STOPPED
    assert engaging.said[-1] == "reset refused: stop commanded"
    engaging.run(100, Command.RESET | Command.STOP)
    assert engaging.mode is Mode.STOPPED
    engaging.run(100, Command.RESET)
    assert engaging.mode is Mode.READY


def test_a_machine_that_still_moves_is_not_reset(moving: Bench) -> None:
    moving.plc.emergency_stop = (True, True)
    moving.run(3)
    moving.plc.emergency_stop = (False, False)
    moving.press(False)
    rolling = moving.joints[0]
    moving.after_sensing(lambda: setattr(rolling, "velocity", 0.5))
    moving.run(RESET + 1, Command.RESET)
    assert moving.mode is Mode.STOPPED
    assert "reset refused: the machine is not at rest yet" in moving.said


def test_what_a_device_says_of_its_error_is_told_once_in_its_own_words(engaging: Bench) -> None:
    drive, name = engaging.joints[1], engaging.joints[1].device.name
    engaging.events.clear()
    for _ in range(3):
        drive.emergency(0x2310, 0x02)
        engaging.run(1)
    drive.emergency(0, 0)
    engaging.run(2)
    said = [event for event in engaging.said if event.startswith(f"{name} says")]
    assert said == [
        f"{name} says EMCY 2310h, register 02h, vendor 00 00 00 00 00",
        f"{name} says EMCY 0000h: its error is gone",
    ]
