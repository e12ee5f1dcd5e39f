"""The master of the canopen package, which knows nothing of ours, on a bus with our simulated devices."""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Callable, Iterator
from importlib import resources
from itertools import count
from typing import Any

import can
import canopen
import pytest
from canopen.objectdictionary import ODVariable
from canopen.profiles.p402 import BaseNode402
from hapticd.devices.device import Device
from hapticd.devices.frames import Frames
from hapticd.devices.network import Network
from hapticd.devices.python_can import python_can
from hapticd.sim.drive import SimDrive
from hapticd.sim.joint_drive import SimJointDrive
from hapticd.sim.nodes import SimNodes

CHANNELS = count()
PATIENCE_S = 10.0
KINDS = ("joint1", "ppu_x", "ft", "imu_carriage", "plc")


class Bus:
    """Simulated devices on a virtual bus, in a thread of their own, and a foreign master."""

    def __init__(self, devices: list[Device]) -> None:
        channel = f"foreign-{next(CHANNELS)}"
        self.network = Network(devices)
        self.nodes = SimNodes(self.network)
        self._adapter = python_can("virtual", channel)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self.master = canopen.Network()
        self.master.NOTIFIER_CYCLE = 0.02
        self.master.connect(interface="virtual", channel=channel)
        self._thread.start()

    def _serve(self) -> None:
        incoming, outgoing = Frames(), Frames()
        while not self._ended.wait(0.5e-3):
            self._adapter.receive(incoming)
            outgoing.clear()
            self.nodes.receive(incoming, outgoing)
            self._adapter.send(outgoing)
            self.nodes.advance(0.5e-3)

    def remote(self, name: str, kind: type[canopen.RemoteNode] = canopen.RemoteNode) -> Any:
        device = self.nodes[name].device
        eds = str(resources.files("hapticd.configs") / device.eds)
        node: Any = self.master.add_node(kind(device.node, eds))
        node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
        return node

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self.master.disconnect()
        self._adapter.close()


@pytest.fixture
def bus(devices: list[Device]) -> Iterator[Bus]:
    bus = Bus(devices)
    yield bus
    bus.close()


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(1e-3)


def test_it_finds_every_device(bus: Bus) -> None:
    bus.master.scanner.search()
    until(lambda: len(bus.master.scanner.nodes) >= 12)
    assert sorted(bus.master.scanner.nodes) == list(range(1, 13))


@pytest.mark.parametrize("name", KINDS)
def test_it_reads_who_a_device_is(bus: Bus, name: str) -> None:
    node = bus.remote(name)
    device = bus.nodes[name].device
    identity = {(0x1018, i): node.sdo[0x1018][i].raw for i in (1, 2, 3)}
    identity[0x1008, 0] = node.sdo[0x1008].raw  # a text: segmented
    assert identity == device.dictionary.identity
    assert node.sdo[0x1000].raw == device.dictionary.default((0x1000, 0))
    assert node.sdo[0x1001].raw == 0


@pytest.mark.parametrize("name", KINDS)
def test_it_reads_every_object_of_the_eds(bus: Bus, name: str) -> None:
    node = bus.remote(name)
    variables = [
        variable
        for entry in node.object_dictionary.values()
        for variable in ([entry] if isinstance(entry, ODVariable) else entry.values())
    ]
    assert len(variables) > 20
    for variable in variables:
        data = node.sdo.upload(variable.index, variable.subindex)
        if variable.data_type in canopen.objectdictionary.NUMBER_TYPES:
            assert 8 * len(data) == len(variable), variable.name


@pytest.mark.parametrize("name", KINDS)
def test_it_reads_what_the_pdos_map_and_cannot_change_it(bus: Bus, name: str) -> None:
    node = bus.remote(name)
    device = bus.nodes[name].device
    node.tpdo.read()
    mapped = [(variable.index, variable.subindex, variable.length) for variable in node.tpdo[1]]
    assert mapped == [(*item.address, 8 * item.size) for item in device.dictionary.tpdo]
    assert node.tpdo[1].cob_id == 0x180 + device.node
    for index, subindex, value in ((0x1A00, 0, 1), (0x1A00, 1, 0x10000008), (0x1800, 1, 0x80000181)):
        with pytest.raises(canopen.SdoAbortedError) as aborted:
            node.sdo[index][subindex].raw = value
        assert aborted.value.code == 0x06010002  # read-only
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        node.sdo[0x1800][2].raw = 255  # it answers SYNC, and nothing else
    assert aborted.value.code == 0x06090031


def test_it_reads_by_sdo_what_the_tpdo_would_say(bus: Bus) -> None:
    node = bus.remote("joint1")
    drive = bus.nodes["joint1"]
    assert isinstance(drive, SimJointDrive)
    drive.position = 0.5
    until(lambda: drive.statusword & 0x4F == 0x40)  # a drive is not ready in the moment it is switched on
    until(lambda: node.sdo[0x6041].raw == drive.statusword)
    assert node.sdo[0x6061].raw == 10
    assert node.sdo[0x6064].raw == pytest.approx(0.5 / 6.283185307 * 65536 * 100, abs=1)
    assert node.sdo[0x2100][2].raw == 2  # PREOP
    node.nmt.state = "OPERATIONAL"
    until(lambda: node.sdo[0x2100][2].raw == 4)  # SAFEOP


@pytest.mark.parametrize(
    ("index", "subindex", "data", "code"),
    [
        (0x3000, 0, None, 0x06020000),
        (0x1018, 9, None, 0x06090011),
        (0x1018, 1, bytes(4), 0x06010002),
        (0x2102, 0, bytes(2), 0x06090032),
        (0x2102, 0, b"\xff\xff", 0x06090031),
        (0x1017, 0, bytes(4), 0x06070010),
        (0x1017, 0, bytes(20), 0x06070010),
        (0x1017, 0, bytes(5000), 0x05040005),
        (0x6040, 0, b"\x06\x00", 0x08000022),
    ],
)
def test_what_a_device_refuses_has_the_standard_s_abort_code_and_ends_nothing(
    bus: Bus, index: int, subindex: int, data: bytes | None, code: int
) -> None:
    node = bus.remote("joint1")
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        if data is None:
            node.sdo.upload(index, subindex)
        else:
            node.sdo.download(index, subindex, data)
    first = aborted.value  # closing its stream, the package may go on after an abort, and be refused again
    while isinstance(first.__context__, canopen.SdoAbortedError):
        first = first.__context__
    assert first.code == code
    assert node.sdo[0x1018][2].raw == 1


def test_segmented_writing_is_understood(bus: Bus) -> None:
    node = bus.remote("joint1")
    node.sdo.download(0x1017, 0, b"\x2c\x01", force_segment=True)
    assert node.sdo[0x1017].raw == 300
    with node.sdo.open(0x1017, 0, "wb", size=None) as stream:  # of unknown length
        stream.write(b"\x90\x01")
    assert node.sdo[0x1017].raw == 400


def test_a_segmented_write_that_is_not_as_long_as_announced_is_refused(bus: Bus) -> None:
    node = bus.remote("joint1")
    initiate = struct.pack("<BHBI", 0x21, 0x1017, 0, 3)
    node.sdo.request_response(initiate)
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        node.sdo.request_response(b"\x0b\x64\x00" + bytes(5))  # two bytes, and no more
    assert aborted.value.code == 0x06070010
    assert node.sdo[0x1017].raw == 0


@pytest.mark.parametrize("mode", ["rb", "wb"])
def test_block_transfers_are_refused_and_not_turned_into_others(bus: Bus, mode: str) -> None:
    node = bus.remote("joint1")
    with (
        pytest.raises(canopen.SdoAbortedError) as aborted,
        node.sdo.open(0x1008, 0, mode, block_transfer=True, size=4),
    ):
        pass
    assert aborted.value.code == 0x05040001
    assert node.sdo[0x1008].raw == "hapticd joint drive"


@pytest.mark.parametrize("ends_with", ["abort", "the last segment", "another transfer"])
def test_a_transfer_that_is_over_is_not_gone_on_with(bus: Bus, ends_with: str) -> None:
    node = bus.remote("joint1")
    stream = node.sdo.open(0x1008, 0, "rb", buffering=0)
    assert stream.read(7) == b"hapticd"
    if ends_with == "abort":
        node.sdo.abort(0x08000000)
    elif ends_with == "another transfer":
        node.sdo.upload(0x1018, 1)
    else:
        stream.readall()
    for specifier in (0x60, 0x70):
        with pytest.raises(canopen.SdoAbortedError) as aborted:
            node.sdo.request_response(bytes([specifier]) + bytes(7))
        assert aborted.value.code == 0x05040001
    assert node.sdo[0x1008].raw == "hapticd joint drive"


def test_it_commands_the_nmt_states_and_hears_them_in_the_heartbeat(bus: Bus) -> None:
    node = bus.remote("imu_handle")
    node.sdo[0x1017].raw = 20
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
        node.nmt.state = state
        time.sleep(0.03)  # one that was under way
        assert node.nmt.wait_for_heartbeat(PATIENCE_S) == state
    waiting = threading.Timer(0.02, lambda: setattr(node.nmt, "state", "RESET"))
    waiting.start()
    node.nmt.wait_for_bootup(PATIENCE_S)
    waiting.join()
    assert node.nmt.state == "PRE-OPERATIONAL"
    assert node.sdo[0x1017].raw == 0  # as after power-up


def test_a_stopped_device_serves_no_sdo(bus: Bus) -> None:
    node = bus.remote("imu_handle")
    node.nmt.state = "STOPPED"
    node.sdo.RESPONSE_TIMEOUT = 0.1
    with pytest.raises(canopen.SdoCommunicationError):
        node.sdo.upload(0x1018, 1)
    node.nmt.state = "PRE-OPERATIONAL"
    node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
    assert node.sdo[0x1018][1].raw == 0x48415054


def test_its_own_sync_disturbs_no_device(bus: Bus) -> None:
    node = bus.remote("joint1")
    node.nmt.state = "OPERATIONAL"
    for _ in range(3):
        bus.master.sync.transmit()  # empty: without the counter of ours
    assert node.sdo[0x2100][2].raw == 4


class OutputFrame(BaseNode402):  # type: ignore[misc]
    """The package's drive, whose controlword travels in our output frame."""

    sent = 0
    target = 0

    @property
    def controlword(self) -> int:
        return self.sent

    @controlword.setter
    def controlword(self, value: int) -> None:
        self.sent = value


@pytest.fixture
def syncing(bus: Bus) -> Iterator[Callable[[OutputFrame, str], None]]:
    """Sends our output frame every two milliseconds, as a foreign master would have to."""
    ended, threads = threading.Event(), []

    def start(node: OutputFrame, slot: str) -> None:
        def run() -> None:
            counter = 0
            while not ended.wait(2e-3):
                counter = (counter + 1) & 0xFFFF
                valid = counter > 5  # SAFEOP first
                data = struct.pack("<HBB" + slot, counter, valid, 0, node.sent, node.target)
                classic = len(data) <= 8
                data = data if classic else data.ljust(12, b"\0")
                bus.master.bus.send(
                    can.Message(arbitration_id=0x80, is_extended_id=False, is_fd=not classic, data=data)
                )

        threads.append(threading.Thread(target=run))
        threads[-1].start()

    yield start
    ended.set()
    for thread in threads:
        thread.join()


@pytest.mark.parametrize(
    ("name", "slot", "mode", "target"),
    [
        ("joint1", "Hh", "CYCLIC SYNCHRONOUS TORQUE", "target_torque"),
        ("ppu_x", "Hi", "CYCLIC SYNCHRONOUS VELOCITY", "target_velocity"),
    ],
)
def test_it_walks_a_drive_to_operation_enabled_and_back(
    bus: Bus, syncing: Callable[[OutputFrame, str], None], name: str, slot: str, mode: str, target: str
) -> None:
    node = bus.remote(name, OutputFrame)
    drive = bus.nodes[name]
    assert isinstance(drive, SimDrive)
    node.nmt.state = "PRE-OPERATIONAL"
    node.sdo[0x2101][1].raw, node.sdo[0x2101][2].raw = 0, 4
    node.sdo[0x2102].raw = 1000  # this master is in no hurry
    node.setup_402_state_machine()
    for timeout in ("SWITCH_OP_MODE", "SWITCH_STATE_FINAL", "SWITCH_STATE_SINGLE", "CHECK_TPDO"):
        setattr(node, f"TIMEOUT_{timeout}", PATIENCE_S)
    node.nmt.state = "OPERATIONAL"
    syncing(node, slot)
    until(lambda: bool(node.tpdo_values[0x6041]))
    node.op_mode = mode
    assert node.op_mode == mode
    assert node.state == "SWITCH ON DISABLED"
    assert drive.brake
    node.state = "OPERATION ENABLED"
    assert node.sdo[0x6041].raw & 0x6F == 0x27
    assert drive.powered
    assert not drive.brake
    node.target = 250
    scale = {"target_torque": 0.1, "target_velocity": 1e-6}[target]
    until(lambda: getattr(drive, target) == pytest.approx(250 * scale))
    node.state = "SWITCH ON DISABLED"
    assert drive.brake


def test_its_silence_trips_the_watchdog_and_the_emergency_says_so(
    bus: Bus, syncing: Callable[[OutputFrame, str], None]
) -> None:
    node = bus.remote("joint1", OutputFrame)
    node.nmt.state = "OPERATIONAL"
    frame = struct.pack("<HBBHh", 7, 1, 0, 0, 0)
    bus.master.send_message(0x80, frame)  # once, and never again
    emergency = node.emcy.wait(0x8250, PATIENCE_S) if not node.emcy.log else node.emcy.log[-1]
    assert emergency is not None and emergency.code == 0x8250
    assert emergency.register == node.sdo[0x1001].raw != 0
    assert emergency.data == bytes(5)
