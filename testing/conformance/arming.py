"""Nothing moves before somebody asks for it, with everything in order, and then gently."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ...devices.safety_plc import SafetyRequest
from ...runtime.core.modes import Command, Mode
from ...runtime.core.senses import REST_SHARE
from ...safety import Reaction, Verdict
from ...sim import faults
from ...sim.drive import SimDrive
from ..bench import Bench, creep, fall, weld
from ..cases import load, unpressed
from ..copies import in_a_copy
from ..suite import wait

SOON = 10
"""Ticks in which a press has been seen."""


def test_it_comes_up_by_itself_and_waits_for_a_press_without_power(new_bench: Bench) -> None:
    assert new_bench.safe
    while new_bench.mode is Mode.BRINGUP:
        new_bench.run(1)
        assert new_bench.safe and new_bench.tick_index < new_bench.ticks(5.0)
    assert new_bench.mode is Mode.READY, new_bench.said
    new_bench.run(new_bench.ticks(0.5))
    assert new_bench.mode is Mode.READY and new_bench.safe
    assert not any(new_bench.cycle.gate.admitted)


def test_a_press_arms_it_and_its_drives_get_power(waiting: Bench) -> None:
    waiting.press(True)
    waiting.until(Mode.ENABLING, limit=SOON)
    waiting.until(Mode.ENGAGING)
    waiting.run(1)
    assert all(drive.powered for drive in waiting.drives)


def test_one_channel_of_the_dead_man_switch_is_not_a_press(waiting: Bench) -> None:
    waiting.plc.dead_man = (True, False)
    waiting.run(SOON)
    assert waiting.mode is Mode.READY


def test_a_switch_that_is_held_from_the_start_does_not_arm(new_bench: Bench) -> None:
    new_bench.press(True)
    wait(new_bench)
    assert new_bench.mode is Mode.READY
    new_bench.press(False)
    new_bench.run(SOON)
    new_bench.press(True)
    new_bench.run(SOON)
    assert new_bench.mode > Mode.READY


@pytest.mark.parametrize("command", [False, True])
def test_where_a_command_arms_a_press_alone_does_not(machine_name: str, command: bool) -> None:
    def press() -> None:
        bench = Bench(unpressed(load(machine_name), "command"))
        wait(bench)
        bench.run(SOON, Command.ARM if command else Command.NONE)
        bench.press(True)
        bench.run(SOON)
        assert (bench.mode > Mode.READY) == command

    in_a_copy(press)()


def test_the_wrench_fades_in_from_the_posture_in_which_it_was_pressed(waiting: Bench) -> None:
    machine, arming = waiting.cycle.machine, waiting.lockstep.session.config.arming
    waiting.press(True)
    waiting.until(Mode.ENGAGING)
    posture, before = np.array(machine.position), 0.0
    fade = 1.0 / waiting.ticks(arming.fade)
    for _ in range(waiting.ticks(0.1)):
        waiting.run(1)
        gain = waiting.cycle.phase.gain
        assert 0.0 < gain - before < 1.5 * fade
        before = gain
        assert (np.abs(np.array(machine.position) - posture) < machine.play).all(), "it jumps"


def _stand_outside(bench: Bench) -> None:
    """A limit comes to an axis, for a measurement that jumps would not be believed; none returns so far."""
    machine = bench.cycle.machine
    object.__setattr__(machine.axes[0], "upper", machine.position[0] - 1.0)


def _latched(bench: Bench) -> None:
    bench.cycle.stops.latch.take(Verdict(Reaction.HOLD, "test", "a test"), 0)


REFUSALS: dict[str, tuple[Callable[[Bench], object], str, Mode]] = {
    # name: (what happens while it waits, why a press then starts nothing, the mode afterwards)
    "drive fault": (lambda b: setattr(b.drives[0], "fault", 0x2310), "devices report an error", Mode.STOPPED),
    "e-stop": (
        lambda b: setattr(b.plc, "emergency_stop", (True, True)),
        "the emergency stop is pressed",
        Mode.STOPPED,
    ),
    "STO": (lambda b: setattr(b.plc, "latched", True), "the safety PLC holds the torque off", Mode.READY),
    "no recorder": (lambda b: b.run(1, Command.UNRECORDED), "the recorder is gone", Mode.READY),
    "latched stop": (_latched, "a stop is latched", Mode.READY),
    "another mode": (lambda b: setattr(b.drives[-1], "mode", 8), "is in mode 8", Mode.READY),
    "a drive with power": (lambda b: weld(b.drives[-1]), "holds the torque off", Mode.STOPPED),
    "outside": (_stand_outside, "stands outside its limits", Mode.READY),
}


def refused(bench: Bench, why: str, mode: Mode) -> None:
    """A press starts nothing, and says why."""
    bench.run(2)
    bench.press(True)
    bench.run(5)
    assert (bench.mode, bench.safe) == (mode, True)
    (event,) = [event for event in bench.said if event.startswith("not started")]
    assert why in event


@pytest.mark.parametrize("name", REFUSALS)
def test_a_press_starts_nothing_while_something_is_amiss(waiting: Bench, name: str) -> None:
    happen, why, mode = REFUSALS[name]
    happen(waiting)
    refused(waiting, why, mode)


@pytest.mark.parametrize("happen", [fall, lambda node: setattr(node, "tamper", faults.drop(4))])
def test_a_press_starts_nothing_while_a_device_does_not_answer_as_it_should(
    waiting: Bench, part_name: str, happen: Callable[[object], object]
) -> None:
    happen(waiting.nodes[part_name])
    refused(waiting, "not all devices answer", Mode.READY)


def test_a_press_starts_nothing_while_an_axis_moves(waiting: Bench, drive_name: str) -> None:
    drive = waiting.nodes[drive_name]
    assert isinstance(drive, SimDrive)
    limits = waiting.cycle.machine.thresholds
    creep(waiting, drive, 2.0 * REST_SHARE * limits.speed[limits.axes.index(drive_name)])
    refused(waiting, "the machine moves", Mode.READY)


def test_an_emergency_stop_of_a_waiting_machine_is_latched_until_a_reset(waiting: Bench) -> None:
    waiting.plc.emergency_stop = (True, False)
    waiting.run(3)
    waiting.plc.emergency_stop = (False, False)
    waiting.run(SOON)
    assert (waiting.mode, waiting.reason) == (Mode.STOPPED, "e_stop")
    assert waiting.plc.request == SafetyRequest.STO
    waiting.run(waiting.ticks(0.2), Command.RESET)
    assert waiting.mode is Mode.READY
    assert waiting.plc.request == 0 and not waiting.plc.sto


def test_a_device_that_is_missing_fails_the_bring_up_and_nothing_gets_power(
    new_bench: Bench, device_name: str
) -> None:
    new_bench.nodes[device_name].silent = True
    new_bench.until(Mode.FAILED, limit=new_bench.ticks(5.0))
    assert any(device_name in event for event in new_bench.said)
    new_bench.run(SOON)
    assert new_bench.safe and new_bench.mode is Mode.FAILED
    assert len(new_bench.lockstep.outputs.frames) == 0
