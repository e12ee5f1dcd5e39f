"""After a stop: what a reset needs, what it refuses, and that nothing starts by itself."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from ...runtime.core.modes import Command, Mode
from ...runtime.live.outcome import Ending, outcome
from ...safety import Reaction
from ...sim import faults
from ...sim.drive import SimDrive
from ..bench import Bench, creep, weld
from ..suite import reset

RESET_S = 0.6
"""In which a reset has worked, or was refused."""


def stopped(bench: Bench) -> None:
    """The person lets go."""
    bench.press(False)
    bench.until(Mode.STOPPED, limit=bench.cycle.stops.ramp_limit + 5)


def held(bench: Bench) -> None:
    """A drive is lost for some ticks: the others hold the machine."""
    bench.last_drive.tamper = faults.drop(6)
    bench.until(Mode.HOLDING)


def test_a_stop_needs_a_reset_and_a_new_press(engaging: Bench) -> None:
    stopped(engaging)
    engaging.press(True)
    engaging.run(engaging.ticks(0.3))
    assert engaging.mode is Mode.STOPPED, "holding the switch again is not enough"
    engaging.run(engaging.ticks(RESET_S), Command.RESET)
    assert engaging.mode is Mode.STOPPED, "a reset needs the switch released"
    assert any("release the dead-man" in event for event in engaging.said)
    reset(engaging)
    assert engaging.safe
    engaging.press(True)
    engaging.until(Mode.ENGAGING)
    assert engaging.cycle.phase.gain == 0.0, "the wrench fades in from the beginning"


def _answer(bench: Bench) -> None:
    for node in bench.nodes.nodes:
        node.silent = False


CAUSES: dict[str, tuple[Callable[[Bench], object], Callable[[Bench], object]]] = {
    "e-stop": (
        lambda b: setattr(b.plc, "emergency_stop", (True, True)),
        lambda b: setattr(b.plc, "emergency_stop", (False, False)),
    ),
    "drive fault": (
        lambda b: setattr(b.drives[0], "fault", 0x2310),
        lambda b: setattr(b.drives[0], "fault", 0),
    ),
    "all silent": (Bench.silence_all, _answer),
}


@pytest.mark.parametrize("name", CAUSES)
def test_a_reset_is_refused_as_long_as_the_cause_is_there(engaging: Bench, name: str) -> None:
    happen, mend = CAUSES[name]
    happen(engaging)
    engaging.until(Mode.STOPPED, limit=engaging.ticks(1.0))
    engaging.press(False)
    engaging.run(10)
    engaging.run(engaging.ticks(RESET_S), Command.RESET)
    assert engaging.mode is Mode.STOPPED
    assert any("reset refused" in event for event in engaging.said)
    mend(engaging)
    engaging.run(10)
    reset(engaging)
    assert engaging.plc.request == 0
    engaging.press(True)
    engaging.until(Mode.ENGAGING)


def test_a_held_machine_refuses_a_reset_and_switches_off_when_the_dead_man_opens(engaging: Bench) -> None:
    held(engaging)
    engaging.run(engaging.ticks(0.2), Command.RESET)
    assert engaging.mode is Mode.HOLDING and not engaging.safe
    assert any("release the dead-man switch first" in event for event in engaging.said)
    stopped(engaging)
    engaging.run(3)
    assert (engaging.reason, engaging.safe) == ("dead_man", True)


def test_a_drive_that_was_lost_gets_no_power_before_the_next_start(moving: Bench) -> None:
    drive = moving.drives[0]
    drive.tamper = faults.drop(6)
    moving.until(Mode.HOLDING)
    assert not drive.powered and drive.brake
    moving.run(moving.ticks(0.3))
    assert not drive.powered
    reset(moving)
    moving.press(True)
    moving.until(Mode.ENGAGING)
    moving.run(1)
    assert drive.powered


@pytest.mark.parametrize("after", [0, 5])
def test_a_drive_that_does_not_switch_off_loses_its_torque_by_the_safety_controller(
    engaging: Bench, drive_name: str, after: int
) -> None:
    drive = engaging.nodes[drive_name]
    assert isinstance(drive, SimDrive)
    weld(drive)
    stopped(engaging)
    engaging.run(after)
    engaging.run(engaging.ticks(0.25))
    # an axis that hangs falls before the drive's time is up
    assert engaging.reason in ("drive_state", "moved")
    assert engaging.cycle.stops.latch.reaction is Reaction.OFF
    assert engaging.plc.sto and engaging.safe


def test_what_is_not_recorded_goes_on_and_is_not_armed_again(engaging: Bench) -> None:
    engaging.run(1, Command.UNRECORDED)
    engaging.run(20)
    assert engaging.mode.powered
    reset(engaging)
    engaging.press(True)
    engaging.run(5)
    assert engaging.mode is Mode.READY and engaging.safe
    assert any("the recorder is gone" in event for event in engaging.said)


def test_an_emergency_stop_while_the_session_ends_is_what_it_ended_with(moving: Bench) -> None:
    moving.run(1, Command.END)
    assert moving.cycle.stops.last is None
    moving.plc.emergency_stop = (True, True)
    moving.run(2)
    stop = moving.cycle.stops.last
    if moving.reason == "end":  # at rest before the switch was seen
        assert stop is None and moving.safe
    else:
        assert stop is not None and stop.verdict.reason == "e_stop"
        moving.until(Mode.STOPPED, limit=moving.cycle.stops.ramp_limit)
        moving.run(3)
        assert outcome(moving.cycle, None, Ending()).status == 3


@pytest.mark.parametrize("mode", [Mode.READY, Mode.HOLDING, Mode.STOPPED])
def test_a_machine_that_is_left_alone_stands(waiting: Bench, mode: Mode) -> None:
    if mode is not Mode.READY:
        waiting.press(True)
        waiting.until(Mode.ENGAGING)
        waiting.run(50)
        (held if mode is Mode.HOLDING else stopped)(waiting)
    waiting.run(waiting.ticks(1.0))
    assert waiting.mode is mode


@pytest.mark.parametrize("state", [Mode.READY, Mode.STOPPED])
def test_a_brake_that_slips_takes_the_torque_off_and_is_latched(
    waiting: Bench, drive_name: str, state: Mode
) -> None:
    if state is Mode.STOPPED:
        waiting.press(True)
        waiting.until(Mode.ENGAGING)
        stopped(waiting)
        waiting.run(50)
    drive, machine = waiting.nodes[drive_name], waiting.cycle.machine
    assert isinstance(drive, SimDrive)
    axis = machine.thresholds.axes.index(drive_name)
    speed = SLIP_SHARE * machine.thresholds.speed[axis]
    creep(waiting, drive, speed)
    waiting.run(waiting.ticks(SLACK * machine.play[axis] / speed + 0.2))
    assert (waiting.mode, waiting.reason) == (Mode.STOPPED, "moved")
    assert waiting.cycle.stops.latch.reaction is Reaction.OFF and waiting.plc.sto


SLIP_SHARE, SLACK = 0.1, 1.1
"""Speed of a brake that slips, as a share of the largest, and of the play in which that must be noticed."""
