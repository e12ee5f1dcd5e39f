from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hapticd.devices.cia402 import TARGETS, TRANSITIONS, State, decode, next_transition
from hapticd.devices.errors import DriveFaultError, DriveModeError, LeftStateError, TransitionError
from hapticd.sim.drives import SimDrive

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
    stuck.outputs_latched = lambda: None  # type: ignore[method-assign]
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
    stray.outputs_latched = lambda: None  # type: ignore[method-assign]
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
    drive.outputs_latched = lambda: None  # type: ignore[method-assign]
    with pytest.raises(LeftStateError, match=r"joint6.*left operation enabled by itself.*switched on"):
        for _ in range(3):
            enabled.tick(enabled.power.step, operational=True)
