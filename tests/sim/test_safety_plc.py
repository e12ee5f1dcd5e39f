from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hapticd.devices.cia402 import State
from hapticd.devices.errors import TransitionError
from hapticd.devices.safety_plc import SafetyRequest, SafetySignals
from hapticd.sim.drive import SimDrive
from hapticd.sim.joint_drive import SimJointDrive
from hapticd.sim.safety_plc import SimSafetyPlc

if TYPE_CHECKING:
    from ..conftest import Rig


def plc(rig: Rig) -> SimSafetyPlc:
    return rig.nodes.of(SimSafetyPlc)[0]


def powered(rig: Rig) -> list[bool]:
    return [drive.powered for drive in rig.nodes.of(SimDrive)]


@pytest.mark.parametrize("channels", [(True, True), (True, False), (False, True)])
def test_an_emergency_stop_takes_the_torque_away_at_once(enabled: Rig, channels: tuple[bool, bool]) -> None:
    enabled.image["joints.target_torque"][:] = 9.0
    enabled.run(1)
    assert all(powered(enabled))
    plc(enabled).emergency_stop = channels
    assert not any(powered(enabled))  # the line is a wire: no frame, no time
    assert all(d.torque == 0.0 and d.brake for d in enabled.nodes.of(SimJointDrive))
    enabled.run(2)
    assert {d.state for d in enabled.nodes.of(SimDrive)} == {State.SWITCH_ON_DISABLED}
    assert not enabled.image.word("joints.statusword")[0] & 0x10  # no voltage


def test_a_request_for_sto_acts_within_the_tick(enabled: Rig) -> None:
    SafetySignals(enabled.image).request(SafetyRequest.STO)
    enabled.run(1)
    assert not any(powered(enabled))


def test_sto_stays_until_its_cause_is_gone_and_it_is_acknowledged(enabled: Rig) -> None:
    signals = SafetySignals(enabled.image)
    plc(enabled).emergency_stop = (True, True)
    enabled.run(3)
    signals.request(SafetyRequest.RESET)
    enabled.run(3)
    assert plc(enabled).sto  # the cause is there
    plc(enabled).emergency_stop = (False, False)
    enabled.run(3)
    assert plc(enabled).sto  # the edge came too early
    signals.request(SafetyRequest(0))
    enabled.run(2)
    signals.request(SafetyRequest.RESET)
    enabled.run(2)
    assert not signals.state().sto
    enabled.run(5)
    assert not any(powered(enabled))  # nothing starts by itself: the drives were switched off
    enabled.walk(State.SWITCH_ON_DISABLED)
    enabled.walk(State.OPERATION_ENABLED)
    assert all(powered(enabled))


def test_under_sto_no_drive_can_be_enabled(ready: Rig) -> None:
    plc(ready).emergency_stop = (True, True)
    ready.image.word("joints.controlword")[:] = 0x06
    ready.run(10)
    assert {d.state for d in ready.nodes.of(SimDrive)} == {State.SWITCH_ON_DISABLED}
    with pytest.raises(TransitionError, match=r"transition 2: not within 50 ticks.*is STO acting"):
        ready.walk(State.OPERATION_ENABLED)


def test_an_nmt_reset_does_not_acknowledge_an_sto(enabled: Rig) -> None:
    plc(enabled).emergency_stop = (True, True)
    enabled.run(2)
    plc(enabled).emergency_stop = (False, False)
    enabled.bring_up()
    assert plc(enabled).sto


def test_a_silent_master_means_sto(enabled: Rig) -> None:
    for _ in range(20):
        enabled.nodes.advance(1e-3)
    assert plc(enabled).sto


def test_leaving_op_withdraws_the_request_but_not_what_it_did(enabled: Rig) -> None:
    SafetySignals(enabled.image).request(SafetyRequest.STO)
    enabled.run(1)
    enabled.run(1, operational=False)
    assert plc(enabled).request == 0
    assert plc(enabled).sto
