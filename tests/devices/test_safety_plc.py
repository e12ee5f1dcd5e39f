from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hapticd.devices.safety_plc import SafetyRequest, SafetySignals, SafetyState
from hapticd.sim.safety_plc import SimSafetyPlc

if TYPE_CHECKING:
    from ..conftest import Rig


@pytest.fixture
def plc(ready: Rig) -> SimSafetyPlc:
    return ready.nodes.of(SimSafetyPlc)[0]


def test_a_controller_that_was_never_heard_reads_as_stop(rig: Rig) -> None:
    assert SafetySignals(rig.image).state() == SafetyState(False, True, False, True, False, False)


def test_the_dead_man_counts_only_on_both_channels(ready: Rig, plc: SimSafetyPlc) -> None:
    signals = SafetySignals(ready.image)
    for channels in ((False, False), (True, False), (False, True), (True, True)):
        plc.dead_man = channels
        ready.run(2)
        assert signals.state() == SafetyState(all(channels), False, True, False, False, False)


@pytest.mark.parametrize(("switch", "field"), [("supervisor", "supervised"), ("override", "overriding")])
def test_the_safety_operators_switch_and_key_count_only_on_both_channels(
    ready: Rig, plc: SimSafetyPlc, switch: str, field: str
) -> None:
    signals = SafetySignals(ready.image)
    for channels in ((False, False), (True, False), (False, True), (True, True)):
        setattr(plc, switch, channels)
        ready.run(2)
        state = signals.state()
        assert (getattr(state, field), state.dead_man) == (all(channels), False)


@pytest.mark.parametrize("channels", [(True, False), (False, True), (True, True)])
def test_the_emergency_stop_acts_on_any_channel(
    ready: Rig, plc: SimSafetyPlc, channels: tuple[bool, bool]
) -> None:
    signals = SafetySignals(ready.image)
    ready.run(2)
    assert signals.state() == SafetyState(False, False, True, False, False, False)
    plc.emergency_stop = channels
    ready.run(2)
    assert signals.state() == SafetyState(False, True, True, True, False, False)


def test_the_scanner_is_read(ready: Rig, plc: SimSafetyPlc) -> None:
    signals = SafetySignals(ready.image)
    plc.scanner_clear = False
    ready.run(2)
    assert not signals.state().field_clear


def test_a_request_reaches_the_controller(ready: Rig, plc: SimSafetyPlc) -> None:
    signals = SafetySignals(ready.image)
    signals.request(SafetyRequest.STO)
    ready.run(2)
    assert plc.request == SafetyRequest.STO
    assert signals.state().sto
