"""The cycle in closed loop with the simulated machine: what a waiting machine remembers until a press."""

import pytest
from hapticd.devices.frames import Frames
from hapticd.runtime.core.modes import Command, Mode
from hapticd.runtime.core.senses import INTRUDER_SILENT_S
from hapticd.runtime.core.start import PERMISSION_S
from hapticd.safety import Reaction
from hapticd.sim import faults
from hapticd.sim.person import Deed

from .conftest import Bench

BY_COMMAND = (
    ('by = "dead-man"', 'by = "command"'),
    ('dead_man = [{ at = "0.3 s", pressed = true }]', "dead_man = []"),
)
SILENT = round(1e3 * INTRUDER_SILENT_S)


@pytest.fixture
def waiting(machine: str) -> Bench:
    """READY, and nobody presses by himself."""
    bench = Bench(BY_COMMAND[1], machine=machine)
    bench.until(Mode.READY)
    bench.run(110)  # long enough to be at rest
    bench.run(20)
    return bench


@pytest.fixture
def commanded(machine: str) -> Bench:
    """READY, to be armed by command and press."""
    bench = Bench(*BY_COMMAND, machine=machine)
    bench.until(Mode.READY)
    bench.run(110)  # long enough to be at rest
    bench.run(20)
    return bench


def intrude(bench: Bench, *frames: tuple[int, bytes]) -> None:
    sent = Frames()
    for can_id, data in frames:
        sent.append(can_id, data)
    bench.lockstep._bus.send(sent)
    bench.run(1)


def starts(bench: Bench) -> bool:
    """Whether a press starts anything."""
    bench.press(False)
    bench.run(5)
    bench.press(True)
    bench.run(10)
    return bench.mode is not Mode.STOPPED and bench.mode is not Mode.READY


@pytest.mark.parametrize(
    "frame", [(0x000, b"\x01\x00"), (0x080, bytes(8)), (0x101, bytes(8)), (0x601, bytes(8))]
)
def test_one_frame_of_a_second_master_forbids_to_start_until_a_reset(
    waiting: Bench, frame: tuple[int, bytes]
) -> None:
    waiting.plant.obey(Deed.RELEASE)  # the hand stays at the handle and pulls at nothing
    intrude(waiting, frame)
    waiting.run(1000)
    assert waiting.reason == "second_master"
    assert not starts(waiting)
    waiting.press(False)
    waiting.run(100, Command.RESET)
    assert waiting.mode is Mode.READY
    assert starts(waiting)


def test_a_second_master_that_goes_on_now_and_then_allows_no_reset(waiting: Bench) -> None:
    for _ in range(5):
        intrude(waiting, (0x601, bytes(8)))
        waiting.run(SILENT - 10, Command.RESET)
        assert waiting.mode is Mode.STOPPED
    assert "reset refused: a second master was heard just now" in waiting.said


def test_a_second_master_during_the_bring_up_is_latched_when_it_ends(bench: Bench) -> None:
    bench.run(3)
    intrude(bench, (0x000, b"\x80\x02"))  # to a node that starts up anyway
    bench.until(Mode.STOPPED)
    assert bench.reason == "second_master"
    assert "during bring-up" in bench.said[-1]
    bench.run(600)
    assert bench.mode is Mode.STOPPED  # the scripted press starts nothing


def test_an_error_that_is_reported_and_reset_within_one_tick_is_latched(waiting: Bench) -> None:
    node = waiting.joints[0].device.node
    intrude(waiting, (0x080 + node, b"\x10\x23\x01" + bytes(5)), (0x080 + node, bytes(8)))
    assert waiting.mode is Mode.STOPPED
    assert waiting.reason == "device_fault"
    assert not starts(waiting)
    waiting.press(False)
    waiting.run(50, Command.RESET)
    assert starts(waiting)


def test_an_error_that_is_reported_and_reset_within_one_tick_stops_the_machine(engaging: Bench) -> None:
    node = engaging.nodes["force_torque"].device.node
    intrude(engaging, (0x080 + node, b"\x10\x23\x01" + bytes(5)), (0x080 + node, bytes(8)))
    assert engaging.reason == "device_fault"
    engaging.until(Mode.STOPPED)


def test_a_silence_that_would_switch_a_running_machine_off_is_latched(waiting: Bench) -> None:
    waiting.nodes["force_torque"].tamper = faults.drop(25)
    waiting.run(200)
    assert waiting.reason == "device_silent"
    assert not starts(waiting)


def test_a_disturbance_that_would_merely_hold_a_running_machine_is_over_when_it_is_over(
    waiting: Bench,
) -> None:
    waiting.nodes["force_torque"].tamper = faults.drop(10)
    waiting.run(200)
    assert waiting.mode is Mode.READY
    assert starts(waiting)


def test_the_session_s_end_forbids_to_start(waiting: Bench) -> None:
    waiting.press(True)
    waiting.run(2, Command.END)
    waiting.run(300)
    assert waiting.mode is Mode.STOPPED
    assert waiting.cycle.stops.last is None
    assert not starts(waiting)


def test_a_press_while_a_stop_stands_says_why_it_starts_nothing(engaging: Bench) -> None:
    engaging.press(False)
    engaging.until(Mode.STOPPED)
    engaging.run(20)
    assert not starts(engaging)
    assert engaging.said[-1] == "not started: a stop is latched; reset it first"


@pytest.mark.parametrize("moment", ["bring-up", "ready", "stopped"])
def test_without_a_recorder_nothing_starts_whenever_it_was_lost(machine: str, moment: str) -> None:
    bench = Bench(machine=machine)
    if moment == "stopped":
        bench.until(Mode.ENGAGING)
        bench.press(False)
        bench.until(Mode.STOPPED)
    elif moment == "ready":
        bench.until(Mode.READY)
    else:
        bench.run(5)
    bench.run(10, Command.UNRECORDED)
    (event,) = [event for event in bench.said if "recorded" in event]
    assert event == "not recorded any more: what runs goes on, and the machine is not armed again"
    if moment == "stopped":
        bench.run(100, Command.RESET)
    bench.run(600)
    assert bench.mode is Mode.READY
    assert not starts(bench)
    assert "the recorder is gone or lost records" in bench.said[-1]


def test_a_stop_revokes_the_command_to_arm(commanded: Bench) -> None:
    commanded.run(100, Command.ARM)
    commanded.run(5, Command.STOP)
    assert commanded.said[-1] == "stop commanded: the command to arm is revoked"
    assert not starts(commanded)
    assert commanded.said[-1].startswith("not started: arming was not commanded")
    commanded.press(False)
    commanded.run(5, Command.ARM)
    assert starts(commanded)


def test_of_stop_and_arm_and_a_press_in_one_tick_the_stop_counts(commanded: Bench) -> None:
    commanded.run(1, Command.ARM)
    commanded.press(True)
    for _ in range(6):
        commanded.run(1, Command.ARM | Command.STOP)
    commanded.run(20)
    assert commanded.mode is Mode.READY
    assert not commanded.cycle.start.permission.given


def test_a_command_to_arm_expires(commanded: Bench) -> None:
    permission = commanded.cycle.start.permission
    commanded.run(1, Command.ARM)
    assert permission._left == 30_000 == round(1e3 * PERMISSION_S)
    permission._left = 10
    commanded.run(10)
    assert permission.given
    commanded.run(1)
    assert not permission.given
    assert commanded.said[-1] == "the command to arm expired after 30 s; give it again"
    assert not starts(commanded)
    commanded.press(False)
    commanded.run(5, Command.ARM)
    permission._left = 10
    commanded.run(5, Command.ARM)
    commanded.run(100)
    assert starts(commanded)


def test_a_command_to_arm_while_a_stop_stands_is_answered(commanded: Bench) -> None:
    intrude(commanded, (0x080, b""))
    commanded.run(1, Command.ARM)
    assert commanded.said[-1] == "not armed: a stop is latched; reset it first"
    commanded.run(400)
    commanded.run(100, Command.RESET)
    assert commanded.mode is Mode.READY
    assert not starts(commanded)


def test_the_answers_of_one_tick_one_tick_late_stop_nothing(engaging: Bench) -> None:
    delayed(engaging, every=1000)
    engaging.run(60)
    assert engaging.mode is Mode.ENGAGING


def test_a_sync_that_every_device_hears_twice_stops_nothing(engaging: Bench) -> None:
    for node in engaging.nodes.nodes:
        node.tamper = faults.duplicate(1)
    engaging.run(200)
    assert engaging.mode is Mode.ENGAGING


@pytest.mark.parametrize(("every", "mode"), [(25, Mode.ENGAGING), (8, Mode.HOLDING)])
def test_late_answers_stop_the_machine_where_they_go_on(engaging: Bench, every: int, mode: Mode) -> None:
    delayed(engaging, every)
    engaging.run(250)
    assert engaging.mode is mode
    assert engaging.cycle.stops.latch.reaction is (Reaction.HOLD if mode is Mode.HOLDING else Reaction.PASS)


def delayed(bench: Bench, every: int) -> None:
    """Once every so many ticks, the answers of one arrive one tick late."""
    bus, held = bench.lockstep._bus, Frames()
    send = bus.send
    ticks = 0

    def late(frames: Frames) -> None:
        nonlocal ticks
        if ticks % every == 0:
            held.extend(frames)
        else:
            if len(held):
                send(held)
                held.clear()
            send(frames)
        ticks += 1

    bus.send = late  # type: ignore[method-assign]
