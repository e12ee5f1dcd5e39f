from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hapticd.devices.cia402 import (
    ENABLE_OPERATION,
    TARGETS,
    TRANSITIONS,
    State,
    decode,
    next_transition,
)
from hapticd.devices.errors import (
    DriveError,
    DriveFaultError,
    DriveModeError,
    LeftStateError,
    TransitionError,
    UnheardError,
)
from hapticd.sim.drive import SimDrive

if TYPE_CHECKING:
    from ..conftest import Rig


@pytest.mark.parametrize(
    ("pattern", "state"),
    [
        ("x0xx 0000", State.NOT_READY_TO_SWITCH_ON),
        ("x1xx 0000", State.SWITCH_ON_DISABLED),
        ("x01x 0001", State.READY_TO_SWITCH_ON),
        ("x01x 0011", State.SWITCHED_ON),
        ("x01x 0111", State.OPERATION_ENABLED),
        ("x00x 0111", State.QUICK_STOP_ACTIVE),
        ("x0xx 1111", State.FAULT_REACTION_ACTIVE),
        ("x0xx 1000", State.FAULT),
    ],
)
def test_a_statusword_is_decoded_by_the_table_of_the_standard(pattern: str, state: State) -> None:
    bits = pattern.replace(" ", "")
    free = bits.count("x")
    for fill in range(2**free):
        digits = iter(f"{fill:0{free}b}")
        low = int("".join(next(digits) if bit == "x" else bit for bit in bits), 2)
        assert decode(low) is state
        assert decode(0xFF00 | low) is state


def test_patterns_that_the_standard_does_not_list_are_unknown() -> None:
    assert decode(0x0001) is State.UNKNOWN
    assert decode(0x0061) is State.UNKNOWN


@pytest.mark.parametrize("transition", TRANSITIONS, ids=lambda t: str(t.number))
def test_the_commands_have_the_bits_of_the_standard(transition: object) -> None:
    masks = {0x06: 0x87, 0x07: 0x8F, 0x0F: 0x8F, 0x00: 0x82, 0x80: 0x80}
    controlword = transition.controlword  # type: ignore[attr-defined]
    assert controlword & masks[controlword] == controlword


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("start", [s for s in State if s is not State.UNKNOWN])
def test_there_is_a_short_way_from_every_state_to_every_target(start: State, target: State) -> None:
    state, numbers = start, []
    while state is not target:
        step = next_transition(state, target)
        assert step is not None
        assert step.source is state
        numbers.append(step.number)
        state = step.target
    assert len(numbers) <= 5
    if target is not State.OPERATION_ENABLED:
        assert 4 not in numbers  # nothing is enabled on the way down


def test_there_is_no_way_out_of_an_unknown_state() -> None:
    assert next_transition(State.UNKNOWN, State.SWITCH_ON_DISABLED) is None


def test_quick_stop_is_no_target(ready: Rig) -> None:
    with pytest.raises(ValueError, match="quick stop active cannot be a target"):
        ready.power.request(State.QUICK_STOP_ACTIVE)


def test_the_drives_walk_up_and_down_together(ready: Rig) -> None:
    drives = ready.nodes.of(SimDrive)
    assert {d.state for d in drives} == {State.SWITCH_ON_DISABLED}
    for target in (
        State.OPERATION_ENABLED,
        State.SWITCHED_ON,
        State.READY_TO_SWITCH_ON,
        State.OPERATION_ENABLED,
        State.SWITCH_ON_DISABLED,
    ):
        assert ready.walk(target) <= 4
        assert {d.state for d in drives} == {target}
        assert all(d.brake is (target is not State.OPERATION_ENABLED) for d in drives)


def test_holding_the_state_costs_nothing_and_changes_nothing(enabled: Rig) -> None:
    controlword = enabled.image.word("joints.controlword").copy()
    for _ in range(10):
        enabled.tick(enabled.power.step, operational=True)
        assert enabled.power.ready
    assert (enabled.image.word("joints.controlword") == controlword).all()


def test_a_transition_that_takes_too_long_is_named(ready: Rig) -> None:
    stuck = ready.nodes["joint4"]
    assert isinstance(stuck, SimDrive)
    stuck.deaf = True
    start = ready.counter
    with pytest.raises(TransitionError) as caught:
        ready.walk(State.OPERATION_ENABLED)
    assert ready.counter - start == 51  # in the tick after the last one that it had
    error = caught.value
    assert (error.device, error.node, error.transition) == ("joint4", 4, 2)
    assert error.state == "switch on disabled"
    assert error.statusword & 0x6F == 0x40
    assert str(error) == (
        "joint4 (node 4) did not make transition 2: not within 50 ticks; "
        "it reports switch on disabled (statusword 0x0250)"
    )


def test_a_drive_that_goes_elsewhere_is_named(ready: Rig) -> None:
    ready.power.request(State.OPERATION_ENABLED)
    for _ in range(2):
        ready.tick(ready.power.step, operational=True)
    stray = ready.nodes["ppu_x"]
    assert isinstance(stray, SimDrive)
    stray.state = State.QUICK_STOP_ACTIVE
    stray.deaf = True
    with pytest.raises(TransitionError, match=r"ppu_x.*transition 4: expected operation enabled.*quick stop"):
        for _ in range(5):
            ready.tick(ready.power.step, operational=True)


def test_a_drive_with_a_statusword_of_no_meaning_is_named(ready: Rig) -> None:
    ready.power.request(State.OPERATION_ENABLED)
    ready.image.word("joints.statusword")[1] = 0x0061
    with pytest.raises(TransitionError, match=r"joint2.*no way to operation enabled.*unknown.*0x0061"):
        ready.power.step()


def test_a_fault_on_the_way_is_an_error_with_its_code(ready: Rig) -> None:
    drive = ready.nodes["joint2"]
    assert isinstance(drive, SimDrive)
    drive.fault = 0x2310
    with pytest.raises(DriveFaultError, match=r"joint2.*error code 0x2310: clear the cause") as caught:
        ready.walk(State.OPERATION_ENABLED)
    assert caught.value.error_code == 0x2310


def test_a_fault_while_holding_is_an_error_even_where_resets_are_allowed(ready: Rig) -> None:
    ready.walk(State.OPERATION_ENABLED, reset_faults=True)
    drive = ready.nodes["joint2"]
    assert isinstance(drive, SimDrive)
    drive.fault = 0x4310
    with pytest.raises(DriveFaultError, match="0x4310"):
        for _ in range(3):
            ready.tick(ready.power.step, operational=True)


def test_a_fault_is_reset_only_on_request_and_only_without_its_cause(ready: Rig) -> None:
    drive = ready.nodes["joint2"]
    assert isinstance(drive, SimDrive)
    drive.fault = 0x2310
    ready.run(3)
    with pytest.raises(TransitionError, match="transition 15: not within 50 ticks"):
        ready.walk(State.OPERATION_ENABLED, reset_faults=True)
    drive.fault = 0
    with pytest.raises(DriveFaultError):
        ready.walk(State.OPERATION_ENABLED)
    ready.walk(State.OPERATION_ENABLED, reset_faults=True)
    assert drive.state is State.OPERATION_ENABLED
    assert drive.error_code == 0


def test_drives_in_fault_can_be_switched_off_with_the_others(enabled: Rig) -> None:
    drive = enabled.nodes["joint2"]
    assert isinstance(drive, SimDrive)
    drive.fault = 0x2310
    enabled.run(3)
    enabled.walk(State.SWITCH_ON_DISABLED)
    others = [d for d in enabled.nodes.of(SimDrive) if d is not drive]
    assert {d.state for d in others} == {State.SWITCH_ON_DISABLED}
    assert drive.state is State.FAULT


def test_a_request_to_switch_off_takes_all_voltage_off_at_once(enabled: Rig) -> None:
    enabled.image.word("joints.statusword")[0] = 0x0061  # even where the walk will fail
    enabled.power.request(State.SWITCH_ON_DISABLED)
    assert not enabled.image.word("joints.controlword").any()
    assert not enabled.image.word("axes.controlword").any()


def test_a_drive_in_another_mode_is_an_error_on_the_way_and_while_holding(ready: Rig) -> None:
    drive = ready.nodes["joint2"]
    own, drive.mode = drive.mode, 8
    with pytest.raises(DriveModeError, match=r"mode 8 .* instead of 10"):
        ready.walk(State.OPERATION_ENABLED)
    drive.mode = own
    ready.walk(State.SWITCH_ON_DISABLED)
    ready.walk(State.OPERATION_ENABLED)
    drive.mode = 8
    with pytest.raises(DriveModeError):
        for _ in range(3):
            ready.tick(ready.power.step, operational=True)


def test_a_drive_that_leaves_the_state_is_not_brought_back(enabled: Rig) -> None:
    drive = enabled.nodes["joint6"]
    assert isinstance(drive, SimDrive)
    drive.state = State.SWITCHED_ON
    drive.deaf = True
    with pytest.raises(LeftStateError, match=r"joint6.*left operation enabled by itself.*switched on"):
        for _ in range(3):
            enabled.tick(enabled.power.step, operational=True)


def silent(rig: Rig, name: str) -> SimDrive:
    drive = rig.nodes[name]
    assert isinstance(drive, SimDrive)
    drive.silent = True
    return drive


def weld(rig: Rig, name: str) -> SimDrive:
    """Its power stage stays as it is, whatever it is told."""
    drive = rig.nodes[name]
    assert isinstance(drive, SimDrive)
    drive.deaf = True
    return drive


def tried(rig: Rig) -> DriveError | None:
    """A tick, whatever the step says."""
    errors: list[DriveError | None] = [None]

    def step() -> None:
        try:
            rig.power.step()
        except DriveError as error:
            errors.append(error)

    rig.tick(step, operational=True)
    return errors[-1]


@pytest.mark.parametrize("target", [State.SWITCH_ON_DISABLED, State.OPERATION_ENABLED])
def test_a_drive_that_did_not_answer_in_this_tick_is_not_where_it_was(ready: Rig, target: State) -> None:
    ready.walk(target)
    drive = silent(ready, "joint3")
    ready.tick(operational=True)
    ready.tick(ready.power.step, operational=True)
    assert not ready.power.ready
    drive.silent = False
    ready.tick(operational=True)
    ready.tick(ready.power.step, operational=True)
    assert ready.power.ready


@pytest.mark.parametrize("target", [State.SWITCH_ON_DISABLED, State.OPERATION_ENABLED])
def test_a_drive_that_stays_unheard_is_an_error_for_nobody_knows_where_it_is(
    ready: Rig, target: State
) -> None:
    ready.walk(target)
    silent(ready, "ppu_y")
    with pytest.raises(UnheardError, match=r"ppu_y .* has not answered for 51 ticks.*, long ago"):
        for _ in range(60):
            ready.tick(ready.power.step, operational=True)
    assert not ready.power.ready


def test_a_drive_that_answers_now_and_then_on_its_way_gets_no_more_time(enabled: Rig) -> None:
    drive = weld(enabled, "joint2")
    enabled.power.request(State.SWITCH_ON_DISABLED)
    start = enabled.counter
    with pytest.raises(TransitionError, match="transition 9"):
        while enabled.counter - start < 200:
            drive.silent = enabled.counter % 10 != 0
            enabled.tick(enabled.power.step, operational=True)
    assert enabled.counter - start < 80


@pytest.mark.parametrize("phase", range(5))
def test_a_drive_that_does_not_move_is_not_taken_for_a_silent_one(enabled: Rig, phase: int) -> None:
    drive = weld(enabled, "joint2")
    enabled.power.request(State.SWITCH_ON_DISABLED)
    with pytest.raises(TransitionError, match="transition 9"):
        for _ in range(100):
            drive.silent = enabled.counter % 5 == phase
            enabled.tick(enabled.power.step, operational=True)


def test_a_drive_that_ignores_disable_voltage_is_an_error_as_long_as_it_does(enabled: Rig) -> None:
    drive = weld(enabled, "joint2")
    enabled.power.request(State.SWITCH_ON_DISABLED)
    errors = []
    for _ in range(120):
        errors.append(tried(enabled))
        assert not enabled.power.ready
    assert [error is None for error in errors] == [True] * 50 + [False] * 70
    assert "joint2 (node 2) did not make transition 9" in str(errors[-1])
    assert enabled.power.live == "joint2 reports operation enabled"
    drive.state = State.SWITCH_ON_DISABLED
    enabled.run(1)
    enabled.tick(enabled.power.step, operational=True)
    assert enabled.power.ready
    assert enabled.power.live == ""


def test_the_error_of_one_drive_keeps_none_from_being_switched_off(enabled: Rig) -> None:
    for name in ("joint1", "ppu_y"):  # around the one that is stuck: their fault is reset all the same
        drive = enabled.nodes[name]
        assert isinstance(drive, SimDrive)
        drive.fault = 0x2310
    stuck = weld(enabled, "joint3")
    enabled.run(3)
    for name in ("joint1", "ppu_y"):
        enabled.nodes[name].fault = 0  # type: ignore[attr-defined]
    enabled.power.request(State.SWITCH_ON_DISABLED, reset_faults=True)
    assert any([tried(enabled) for _ in range(60)])
    assert {d.state for d in enabled.nodes.of(SimDrive) if d is not stuck} == {State.SWITCH_ON_DISABLED}


def test_the_error_of_one_drive_on_the_way_up_keeps_the_others_where_they_are(ready: Rig) -> None:
    drive = ready.nodes["ppu_y"]  # the last one
    assert isinstance(drive, SimDrive)
    drive.mode = 8
    ready.run(2)
    ready.power.request(State.OPERATION_ENABLED)
    for _ in range(5):
        with pytest.raises(DriveModeError):
            ready.tick(ready.power.step, operational=True)
        ready.run(1)
    assert {d.state for d in ready.nodes.of(SimDrive)} == {State.SWITCH_ON_DISABLED}
    assert not ready.image.word("joints.controlword").any()


@pytest.mark.parametrize("ticks", range(4))
def test_a_drive_in_another_mode_is_never_enabled(ready: Rig, ticks: int) -> None:
    """Whenever on the way its mode changes; once it is told to enable operation, it is enabled."""
    drive = ready.nodes["joint2"]
    assert isinstance(drive, SimDrive)
    ready.power.request(State.OPERATION_ENABLED)
    for _ in range(ticks):
        ready.tick(ready.power.step, operational=True)
    told = ready.image.word("joints.controlword")[1] == ENABLE_OPERATION
    drive.mode = 8
    ready.tick(operational=True)  # its answer is one tick old
    with pytest.raises(DriveModeError):
        for _ in range(5):
            ready.tick(ready.power.step, operational=True)
    assert told or drive.state is not State.OPERATION_ENABLED
    assert told == (ticks == 3)


def test_a_fault_reaction_that_does_not_end_is_not_off(enabled: Rig) -> None:
    drive = enabled.nodes["joint2"]
    assert isinstance(drive, SimDrive)
    advance = enabled.nodes.advance

    def stuck(dt: float) -> None:
        advance(dt)
        drive.state = State.FAULT_REACTION_ACTIVE

    enabled.nodes.advance = stuck  # type: ignore[method-assign]
    enabled.run(3)
    enabled.power.request(State.SWITCH_ON_DISABLED)
    with pytest.raises(TransitionError, match="transition 14: not within 50 ticks"):
        for _ in range(60):
            enabled.tick(enabled.power.step, operational=True)
            assert not enabled.power.ready
    assert enabled.power.live == "joint2 reports fault reaction active"


def test_a_drive_that_faults_while_it_is_off_or_on_its_way_is_off_in_the_end(enabled: Rig) -> None:
    drive = enabled.nodes["joint2"]
    assert isinstance(drive, SimDrive)
    enabled.power.request(State.SWITCH_ON_DISABLED)
    for tick in range(20):
        drive.fault = 0x2310 if tick in (0, 10) else 0
        enabled.tick(enabled.power.step, operational=True)
    assert enabled.power.ready
    assert drive.state is State.FAULT
    enabled.walk(State.SWITCH_ON_DISABLED, reset_faults=True)
    assert drive.state is State.SWITCH_ON_DISABLED


def test_a_drive_that_switches_itself_on_is_an_error_at_once(ready: Rig) -> None:
    ready.walk(State.SWITCH_ON_DISABLED)
    drive = weld(ready, "joint5")
    drive.state = State.OPERATION_ENABLED
    ready.run(2)
    with pytest.raises(LeftStateError, match=r"joint5.*left switch on disabled by itself"):
        ready.tick(ready.power.step, operational=True)
    assert not ready.power.ready


def test_what_keeps_a_drive_from_being_enabled_is_named(ready: Rig) -> None:
    ready.run(3)
    drive = ready.nodes["joint4"]
    assert isinstance(drive, SimDrive)
    assert ready.power.unfit == ready.power.live == ""
    drive.mode = 8
    ready.run(2)
    assert ready.power.unfit == "joint4 is in mode 8 (6061h) instead of 10"
    drive.fault = 0x2310
    ready.run(4)
    assert ready.power.unfit == "joint4 reports fault"
    assert ready.power.live == ""  # without torque
    drive.silent = True
    ready.run(2)
    assert ready.power.unfit == ready.power.live == "joint4 does not answer"


def test_drives_may_give_torque_from_the_controlword_that_enables_the_first(ready: Rig) -> None:
    ready.power.request(State.OPERATION_ENABLED)
    seen = []
    while not ready.power.ready:
        before = ready.power.enabling
        ready.tick(ready.power.step, operational=True)
        seen.append(before)
        assert ready.power.enabling or not any(d.powered for d in ready.nodes.of(SimDrive))
    assert seen == [False, False, False, True]
    ready.walk(State.SWITCH_ON_DISABLED)
    assert not ready.power.enabling


@pytest.mark.parametrize(("index", "name"), [(0, "joint1"), (3, "joint4"), (6, "ppu_x")])
def test_a_dropped_drive_is_switched_off_alone_and_stays_off_until_the_next_request(
    enabled: Rig, index: int, name: str
) -> None:
    dropped = enabled.nodes[name]
    assert isinstance(dropped, SimDrive)
    others = [node for node in enabled.nodes.of(SimDrive) if node is not dropped]
    enabled.power.drop(index)
    for _ in range(5):
        enabled.tick(enabled.power.step, operational=True)
    assert dropped.state is State.SWITCH_ON_DISABLED and dropped.brake
    assert all(node.state is State.OPERATION_ENABLED for node in others)
    assert enabled.power.live  # the others have power: the stage is not without torque
    enabled.walk(State.SWITCH_ON_DISABLED)
    enabled.walk(State.OPERATION_ENABLED)
    assert dropped.state is State.OPERATION_ENABLED
