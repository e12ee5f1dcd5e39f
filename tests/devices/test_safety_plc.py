from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hapticd.devices.safety_plc import SafetyInput, SafetyRequest, SafetySignals
from hapticd.sim.plc import SimSafetyPlc

if TYPE_CHECKING:
    from ..conftest import Rig


@pytest.fixture
def plc(ready: Rig) -> SimSafetyPlc:
    return ready.nodes.of(SimSafetyPlc)[0]


def test_a_controller_that_was_never_heard_reads_as_stop(rig: Rig) -> None:
    signals = SafetySignals(rig.image)
    assert signals.inputs == 0
    assert not signals.dead_man
    assert signals.emergency_stop
    assert signals.sto
    assert not signals.scanner_clear
    assert signals.state() == (False, True, False, True)


def test_the_dead_man_counts_only_on_both_channels(ready: Rig, plc: SimSafetyPlc) -> None:
    signals = SafetySignals(ready.image)
    for channels, pressed, disagreement in (
        ((False, False), False, False),
        ((True, False), False, True),
        ((False, True), False, True),
        ((True, True), True, False),
    ):
        plc.dead_man = channels
        ready.run(2)
        assert signals.dead_man is pressed
        assert signals.state() == (
            signals.dead_man,
            signals.emergency_stop,
            signals.scanner_clear,
            signals.sto,
        )
        assert signals.disagreement is disagreement


@pytest.mark.parametrize("channels", [(True, False), (False, True), (True, True)])
def test_the_emergency_stop_acts_on_any_channel(
    ready: Rig, plc: SimSafetyPlc, channels: tuple[bool, bool]
) -> None:
    signals = SafetySignals(ready.image)
    ready.run(2)
    assert not signals.emergency_stop
    assert not signals.sto
    plc.emergency_stop = channels
    ready.run(2)
    assert signals.emergency_stop
    assert signals.sto


def test_the_scanner_is_read(ready: Rig, plc: SimSafetyPlc) -> None:
    signals = SafetySignals(ready.image)
    ready.run(2)
    assert SafetyInput.SCANNER_CLEAR in signals.inputs
    plc.scanner_clear = False
    ready.run(2)
    assert not signals.scanner_clear


def test_a_request_reaches_the_controller(ready: Rig, plc: SimSafetyPlc) -> None:
    signals = SafetySignals(ready.image)
    signals.request(SafetyRequest.STO)
    ready.run(2)
    assert plc.request == SafetyRequest.STO
    assert signals.sto
