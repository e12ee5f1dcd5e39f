from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hapticd.devices.axis_drive import AxisDrive
from hapticd.devices.bringup import Bringup
from hapticd.devices.cia301 import Address, AlState, NmtState
from hapticd.devices.cia402 import State
from hapticd.devices.device import Device, Field, Quantity
from hapticd.devices.errors import NetworkError
from hapticd.devices.frames import Frames
from hapticd.devices.image import ProcessImage
from hapticd.devices.network import Network
from hapticd.devices.safety_plc import SafetyRequest, SafetySignals
from hapticd.sim import faults
from hapticd.sim.axis_drive import SimAxisDrive
from hapticd.sim.drive import SimDrive
from hapticd.sim.force_torque import SimForceTorque
from hapticd.sim.imu import SimImu
from hapticd.sim.joint_drive import SimJointDrive
from hapticd.sim.node import SimNode
from hapticd.sim.nodes import SimNodes

if TYPE_CHECKING:
    from ..conftest import Rig

MS = 1e-3


def ask(nodes: SimNodes, *frames: tuple[int, bytes]) -> list[tuple[int, bytes]]:
    incoming, outgoing = Frames(), Frames()
    for can_id, data in frames:
        incoming.append(can_id, data)
    nodes.receive(incoming, outgoing)
    return list(outgoing)


def test_a_device_announces_itself_at_power_up_and_after_a_reset(devices: list[Device]) -> None:
    nodes = SimNodes(Network(devices))
    boot_ups = [(0x700 + n, b"\0") for n in range(1, 13)]
    assert ask(nodes) == boot_ups
    assert ask(nodes) == []
    assert ask(nodes, (0x000, b"\x81\x00")) == boot_ups
    assert ask(nodes, (0x000, b"\x82\x05")) == [(0x705, b"\0")]


def test_a_device_answers_sync_only_in_operational(devices: list[Device]) -> None:
    nodes = SimNodes(Network(devices))
    ask(nodes)
    sync = (0x080, b"\x07\x00\x00\x00".ljust(48, b"\0"))
    assert ask(nodes, sync) == []
    ask(nodes, (0x000, b"\x01\x03"))
    assert [(can_id, data[:3]) for can_id, data in ask(nodes, sync)] == [(0x183, b"\x07\x00\x04")]
    ask(nodes, (0x000, b"\x80\x03"))
    assert ask(nodes, sync) == []
    ask(nodes, (0x000, b"\x02\x03"))
    assert nodes["joint3"].nmt_state is NmtState.STOPPED
    assert ask(nodes, sync) == []


def test_inputs_are_reported_as_the_plant_set_them(ready: Rig) -> None:
    joint, axis = ready.nodes["joint2"], ready.nodes["ppu_y"]
    ft, imu = ready.nodes["ft"], ready.nodes["imu_handle"]
    assert isinstance(joint, SimJointDrive)
    assert isinstance(axis, SimAxisDrive)
    assert isinstance(ft, SimForceTorque)
    assert isinstance(imu, SimImu)
    joint.position, joint.link_position, joint.velocity, joint.load_torque = 0.5, -0.25, 1.5, -42.0
    axis.position, axis.velocity = -1.25, 0.75
    ft.wrench = np.array([1.0, 2.0, -3.0, 0.5, -0.25, 0.125])
    imu.acceleration, imu.angular_velocity = (0.0, 0.0, 9.5), (0.1, 0.2, -0.3)
    ready.run(2)
    image = ready.image
    assert image["joints.position"][1] == pytest.approx(0.5, abs=1e-6)
    assert image["joints.link_position"][1] == pytest.approx(-0.25, abs=6e-6)
    assert image["joints.velocity"][1] == pytest.approx(1.5, abs=1e-6)
    assert image["joints.load_torque"][1] == pytest.approx(-42.0, abs=0.05)
    assert image["axes.position"].tolist() == [0.0, -1.25]
    assert image["axes.velocity"].tolist() == [0.0, 0.75]
    np.testing.assert_allclose(image["force_torque.wrench"][0], ft.wrench)
    np.testing.assert_allclose(image["imus.acceleration"][1], [0.0, 0.0, 9.5])
    np.testing.assert_allclose(image["imus.angular_velocity"][1], [0.1, 0.2, -0.3], rtol=1e-6)


def test_inputs_beyond_their_type_saturate(ready: Rig) -> None:
    joint, ft = ready.nodes["joint1"], ready.nodes["ft"]
    assert isinstance(joint, SimJointDrive)
    assert isinstance(ft, SimForceTorque)
    joint.load_torque, joint.velocity = 1e6, -1e9
    ft.wrench = [float("nan"), 1e300, 0.0, 0.0, 0.0, 0.0]
    ready.run(2)
    assert ready.image["joints.load_torque"][0] == pytest.approx(3276.7)
    assert ready.image["joints.velocity"][0] < -2000.0
    assert np.isnan(ready.image["force_torque.wrench"][0, 0])
    assert ready.image["force_torque.wrench"][0, 1] > 3e38


def test_heartbeats_follow_plant_time(ready: Rig) -> None:
    beats: list[int] = []
    for _ in range(1000):
        ready.run(1)
        beats += [can_id for can_id, data in ready.incoming if can_id > 0x700 and data == b"\x05"]
    assert {node: beats.count(node) for node in set(beats)} == {0x700 + n: 10 for n in range(1, 13)}
    assert (ready.image.nmt_state == NmtState.OPERATIONAL).all()
    assert not ready.image.lost.any()


def test_no_output_frame_no_torque_within_the_watchdog_time(enabled: Rig) -> None:
    """A dead daemon: the devices need nobody's help."""
    enabled.image["joints.target_torque"][:] = 10.0
    enabled.run(1)
    drives = enabled.nodes.of(SimJointDrive)
    assert all(d.torque == pytest.approx(10.0) for d in drives)  # one millisecond has passed
    for elapsed in range(2, 20):
        enabled.nodes.advance(MS)
        assert all(d.powered for d in drives), elapsed
    enabled.nodes.advance(MS)
    assert not any(d.powered for d in enabled.nodes.of(SimDrive))
    assert all(d.brake and d.torque == 0.0 and d.al_state is AlState.SAFEOP for d in drives)
    answers = Frames()
    enabled.nodes.receive(Frames(), answers)
    emergencies = {can_id: data for can_id, data in answers if 0x080 < can_id < 0x100}
    assert sorted(emergencies) == [*range(0x081, 0x089), 0x08C]
    assert {data[:2] for data in emergencies.values()} == {b"\x50\x82"}


def test_a_tripped_watchdog_stays_until_the_master_acknowledges_and_resets(enabled: Rig) -> None:
    for _ in range(20):
        enabled.nodes.advance(MS)
    joint = enabled.nodes["joint1"]
    assert isinstance(joint, SimJointDrive)
    enabled.image["joints.target_torque"][:] = 10.0
    enabled.run(30)  # the master is back, and believes that nothing happened
    assert joint.al_state is AlState.SAFEOP
    assert joint.torque == 0.0
    assert enabled.image.al_state[0] == AlState.SAFEOP
    assert enabled.image.emcy[[0, 11]].tolist() == [0x8250, 0x8250]  # of a drive and of the controller
    enabled.run(1, operational=False)
    enabled.run(5)
    assert enabled.image.emcy[[0, 11]].tolist() == [0x8250, 0]  # a drive's fault is to be reset
    assert joint.al_state is AlState.OP
    assert joint.torque == 0.0
    assert joint.error_code == 0x8250
    SafetySignals(enabled.image).request(SafetyRequest.RESET)  # the controller tripped as well
    enabled.run(1)
    enabled.walk(State.OPERATION_ENABLED, reset_faults=True)
    assert joint.torque == pytest.approx(10.0)
    enabled.run(2)
    assert enabled.image.emcy[0] == 0


def test_the_same_sync_again_does_not_feed_the_watchdog(enabled: Rig) -> None:
    incoming, answers = Frames(), Frames()
    incoming.extend(enabled.outgoing)
    for _ in range(25):
        answers.clear()
        enabled.nodes.receive(incoming, answers)
        enabled.nodes.advance(MS)
    assert not any(d.powered for d in enabled.nodes.of(SimDrive))


def test_the_watchdog_time_is_the_one_that_was_configured(rig: Rig) -> None:
    rig.bring_up(Bringup(rig.image, rig.deadlines, watchdog_ms=5))
    rig.walk(State.OPERATION_ENABLED)  # its last tick was the first millisecond
    for _ in range(3):
        rig.nodes.advance(MS)
    assert all(d.powered for d in rig.nodes.of(SimDrive))
    rig.nodes.advance(MS)
    assert not any(d.powered for d in rig.nodes.of(SimDrive))


def test_outputs_that_are_not_valid_switch_the_drives_off(enabled: Rig) -> None:
    enabled.run(1, operational=False)
    assert not any(d.powered for d in enabled.nodes.of(SimDrive))
    assert {d.al_state for d in enabled.nodes.of(SimDrive)} == {AlState.SAFEOP}
    enabled.run(3)
    assert not any(d.powered for d in enabled.nodes.of(SimDrive))


def test_an_output_frame_of_another_tick_is_not_latched(make_rig: type[Rig]) -> None:
    rig = make_rig([AxisDrive(name=f"axis{i}", node=i, counts_per_metre=1000) for i in range(1, 12)])
    rig.bring_up()
    incoming = Frames()
    rig.image.word("axes.controlword")[:] = 0x06
    rig.image.compose(incoming, 500, operational=True)
    (first, payload), sync = incoming
    assert first == 0x101
    answers = ask(rig.nodes, (first, struct.pack("<H", 499) + payload[2:]), sync)
    states = {can_id: data[2] for can_id, data in answers if can_id > 0x180}
    assert states[0x18A] == AlState.OP  # its slot is in SYNC
    assert states[0x18B] == AlState.SAFEOP  # its slot is in the frame that came late
    sync = (0x080, struct.pack("<H", 501) + sync[1][2:])
    answers = ask(rig.nodes, (first, struct.pack("<H", 501) + payload[2:]), sync)
    assert {data[2] for can_id, data in answers if can_id > 0x180} == {AlState.OP}


def test_an_output_frame_is_for_one_sync(make_rig: type[Rig]) -> None:
    rig = make_rig([AxisDrive(name=f"axis{i}", node=i, counts_per_metre=1000) for i in range(1, 12)])
    rig.bring_up()
    incoming = Frames()
    rig.image.compose(incoming, 500, operational=True)
    first, sync = incoming
    answers = ask(rig.nodes, first, sync)
    assert {data[2] for can_id, data in answers if can_id > 0x180} == {AlState.OP}
    answers = ask(rig.nodes, (0x000, b"\x01\x00"), sync)  # started anew, they know no counter
    states = {can_id: data[2] for can_id, data in answers if can_id > 0x180}
    assert (states[0x18A], states[0x18B]) == (AlState.OP, AlState.SAFEOP)


def test_a_silent_device_is_missed_and_nothing_else(enabled: Rig) -> None:
    enabled.nodes["imu_handle"].silent = True
    enabled.run(6)
    assert enabled.image.working_counter == 11
    assert enabled.image.missed.tolist() == [0] * 10 + [5, 0]
    enabled.nodes["imu_handle"].silent = False
    enabled.run(2)
    assert enabled.image.working_counter == 12


def test_lost_frames_are_missed_and_counted(enabled: Rig) -> None:
    enabled.nodes["joint3"].tamper = faults.drop(3)
    missed = []
    for _ in range(6):
        enabled.run(1)
        missed.append(int(enabled.image.missed[2]))
    assert missed == [0, 1, 2, 3, 0, 0]


def test_duplicated_frames_are_counted(enabled: Rig) -> None:
    enabled.nodes["joint3"].tamper = faults.duplicate(2)
    enabled.run(4)
    assert enabled.count("duplicate") == 2
    assert enabled.image.working_counter == 12


def test_late_frames_are_stale(enabled: Rig) -> None:
    enabled.nodes["joint3"].tamper = faults.delay(1)
    enabled.run(2)
    assert enabled.image.working_counter == 11
    enabled.run(2)
    assert enabled.count("stale") == 1
    assert enabled.image.working_counter == 12


def test_a_flipped_bit_in_the_counter_is_dropped(enabled: Rig) -> None:
    enabled.nodes["joint3"].tamper = faults.corrupt(2, byte=1, mask=0x80)
    enabled.run(4)
    assert enabled.count("stale") + enabled.count("ahead") == 2
    assert enabled.image.working_counter == 12


def test_a_shortened_frame_is_dropped(enabled: Rig) -> None:
    enabled.nodes["joint3"].tamper = faults.truncate(1)
    enabled.run(2)
    assert enabled.count("length") == 1
    assert enabled.image.working_counter == 11


def test_a_device_that_restarts_while_running_is_lost(enabled: Rig) -> None:
    enabled.nodes["joint3"].reset()
    enabled.run(2)
    assert enabled.image.lost.tolist() == [False, False, True] + [False] * 9


def test_random_frames_never_crash_the_devices(enabled: Rig, caplog: pytest.LogCaptureFixture) -> None:
    rng = np.random.default_rng(5)
    ids = [0x000, 0x080, 0x101, 0x13F, 0x140, 0x601, 0x602, 0x60C, 0x7FF, 0x181]
    incoming, answers = Frames(), Frames()
    for _ in range(3000):
        incoming.clear()
        answers.clear()
        for _ in range(rng.integers(0, 10)):
            incoming.append(int(rng.choice(ids)), rng.bytes(int(rng.choice([0, 1, 2, 3, 4, 8, 48, 64]))))
        enabled.nodes.receive(incoming, answers)
        enabled.nodes.advance(MS)
    assert not [record for record in caplog.records if record.levelname == "ERROR"]


def test_two_runs_are_identical(make_rig: type[Rig], devices: list[Device]) -> None:
    logs = []
    for _ in range(2):
        rig = make_rig(devices)
        rig.bring_up()
        log = []
        for tick in range(300):
            rig.nodes["joint1"].position = np.sin(tick * 0.01)  # type: ignore[attr-defined]
            rig.run(1)
            log.append(rig.incoming.pack() + rig.outgoing.pack())
        logs.append(log)
    assert logs[0] == logs[1]


class Thermometer(Device, frozen=True, kw_only=True):
    group: str = "temperatures"
    eds: str = "imu.eds"

    def inputs(self) -> Mapping[Address, Field]:
        return {(0x2401, 3): Quantity("temperature", scale=10.0)}


class SimThermometer(SimNode):
    temperature = 250.0


def test_a_device_of_ones_own_needs_no_more_than_this() -> None:
    image = ProcessImage(Network([Thermometer(name="bath", node=20)]))
    nodes = SimNodes(image.network, {Thermometer: SimThermometer})
    ask(nodes, (0x000, b"\x01\x00"))
    frames, answers = Frames(), Frames()
    image.compose(frames, 1, operational=True)
    nodes.receive(frames, answers)
    assert image.latch(answers, 1) == 1
    assert image["temperatures.temperature"].tolist() == [250.0]


class Computed(SimNode):
    @property
    def temperature(self) -> float:
        return 250.0


def test_a_field_that_the_core_could_not_read_is_refused() -> None:
    network = Network([Thermometer(name="bath", node=20)])
    with pytest.raises(NetworkError, match=r"bath.*Computed\.temperature is not a plain value"):
        SimNodes(network, {Thermometer: Computed})


class Undriven(SimDrive):
    own_mode = 10
    moved_by = "target_torque"


def test_a_drive_without_what_moves_it_is_refused() -> None:
    network = Network([AxisDrive(name="axis", node=1, counts_per_metre=1000)])
    with pytest.raises(NetworkError, match=r"axis.*Undriven needs its field 'target_torque'"):
        SimNodes(network, {AxisDrive: Undriven})


def test_what_does_not_fit_into_the_outbox_pushes_out_the_oldest(devices: list[Device]) -> None:
    nodes = SimNodes(Network(devices))
    ask(nodes)
    for code in range(100):
        nodes["joint1"].emergency(0x1000 + code, 1)
    assert [data[0] for _, data in ask(nodes)] == list(range(36, 100))


def test_what_there_is_no_room_for_waits(devices: list[Device]) -> None:
    nodes = SimNodes(Network(devices))
    short, rest = Frames(5), Frames()
    nodes.receive(Frames(), short)
    nodes.receive(Frames(), rest)
    assert [can_id for can_id, _ in (*short, *rest)] == [0x700 + n for n in range(1, 13)]
    assert len(short) == 5


def test_a_deaf_drive_switches_off_without_valid_outputs_and_a_welded_one_does_not(enabled: Rig) -> None:
    deaf, welded = enabled.nodes.of(SimDrive)[:2]
    deaf.deaf = welded.deaf = welded.welded = True
    enabled.image.word("joints.controlword")[:] = 0
    enabled.run(3)
    assert deaf.powered and welded.powered
    assert not enabled.nodes.of(SimDrive)[2].powered
    enabled.run(1, operational=False)
    assert (deaf.state, welded.state) == (State.SWITCH_ON_DISABLED, State.OPERATION_ENABLED)
