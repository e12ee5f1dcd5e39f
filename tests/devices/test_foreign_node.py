"""A node of the canopen package on our bus is brought up, refused or named, as it deserves."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator
from importlib import resources
from itertools import count
from typing import Any

import can
import canopen
import pytest
from hapticd.devices.bringup import Bringup, BringupState, Deadlines
from hapticd.devices.cia402 import PowerStage, State
from hapticd.devices.device import Device
from hapticd.devices.errors import (
    BringupError,
    MismatchError,
    MissingDevicesError,
    SilentDeviceError,
    StartError,
    TransferError,
    TransitionError,
)
from hapticd.devices.frames import Frames
from hapticd.devices.image import COUNTERS, ProcessImage
from hapticd.devices.network import Network
from hapticd.devices.python_can import python_can

CHANNELS = count()
TICK_S = 1e-3
DEADLINES = Deadlines(boot=1500, response=1000, configuration=10_000, start=500)
KINDS = {"joint1": 0, "ppu_x": 6, "ft": 8, "imu_carriage": 9, "plc": 11}


class FdNetwork(canopen.Network):  # type: ignore[misc]
    """Sends what is longer than a classic frame as CAN FD."""

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self.bus.send(
            can.Message(
                arbitration_id=can_id,
                is_extended_id=False,
                is_fd=len(data) > 8,
                is_remote_frame=remote,
                data=data,
            )
        )


def hear_classic_frames_only(bus: can.BusABC) -> None:
    receive = bus.recv

    def filtered(timeout: float | None = None) -> can.Message | None:
        message = receive(timeout)
        return None if message is None or message.is_fd else message

    bus.recv = filtered  # type: ignore[method-assign]


class ForeignNode:
    """A `LocalNode`, with the little that an application on top of it has to do for our wire."""

    def __init__(self, device: Device, eds: str | None = None, *, classic: bool = False, **bus: Any) -> None:
        self.network = FdNetwork()
        self.network.NOTIFIER_CYCLE = 0.02
        self.network.bus = can.Bus(**{"interface": "virtual", **bus})
        if classic:
            hear_classic_frames_only(self.network.bus)
        self.network.connect()
        path = eds or str(resources.files("hapticd.configs") / device.eds)
        self.node: Any = self.network.create_node(device.node, path)
        self.heard: list[tuple[int, bytes]] = []
        self.enabled_outputs = 0
        for (index, subindex), value in device.facts().items():
            self.preset(index, subindex, value)
        self.network.subscribe(0x000, self._nmt)
        self.network.subscribe(0x080, self._sync)

    def preset(self, index: int, subindex: int, value: object) -> None:
        variable = self.node.sdo[index]
        (variable[subindex] if subindex or not hasattr(variable, "raw") else variable).raw = value

    def _nmt(self, can_id: int, data: bytearray, timestamp: float) -> None:
        if data[0] in (0x81, 0x82):  # the package leaves the boot-up to the application
            self.node.nmt.send_command(0x81)
            self.node.nmt.send_command(0x80)

    def _sync(self, can_id: int, data: bytearray, timestamp: float) -> None:
        counter, flags = struct.unpack_from("<HB", data)
        self.enabled_outputs += flags & 1
        if self.node.nmt.state == "OPERATIONAL":
            payload = struct.pack("<HB", counter, 8 if flags & 1 else 4) + self.inputs
            self.node.network.send_message(0x180 + self.node.id, payload.ljust(self.tpdo_length, b"\0"))

    tpdo_length = 0
    inputs = b""

    def close(self) -> None:
        self.node.nmt.stop_heartbeat()
        self.network.disconnect()


class Master:
    """Our side: bring-up, one tick per millisecond."""

    def __init__(self, channel: str, device: Device) -> None:
        self.image = ProcessImage(Network([device]))
        self.bus = python_can("virtual", channel)
        self.incoming, self.outgoing = Frames(), Frames()
        self.counter = 0

    def tick(self, step: Callable[[], object], operational: bool = False) -> None:
        self.bus.receive(self.incoming)
        self.image.latch(self.incoming, self.counter)
        self.counter += 1
        self.outgoing.clear()
        step()
        self.image.compose(self.outgoing, self.counter, operational)
        self.bus.send(self.outgoing)
        time.sleep(TICK_S)

    def bring_up(self, deadlines: Deadlines = DEADLINES) -> None:
        bringup = Bringup(self.image, deadlines)
        while bringup.state is not BringupState.READY:
            self.tick(lambda: bringup.step(self.incoming, self.outgoing))

    def counted(self) -> dict[str, int]:
        return {name: int(n) for name, n in zip(COUNTERS, self.image.counters, strict=True) if n}


Foreign = Callable[..., tuple[ForeignNode, Master]]


@pytest.fixture
def foreign(devices: list[Device]) -> Iterator[Foreign]:
    opened: list[Any] = []

    def begin(name: str, eds: str | None = None) -> tuple[ForeignNode, Master]:
        channel = f"node-{next(CHANNELS)}"
        device = devices[KINDS[name]]
        master = Master(channel, device)
        opened.append(master.bus)
        node = ForeignNode(device, eds, channel=channel)
        node.tpdo_length = master.image.network.tpdo_length[0]
        opened.append(node)
        return node, master

    yield begin
    for end in reversed(opened):
        end.close()


@pytest.mark.parametrize("name", KINDS)
def test_a_foreign_node_with_our_eds_is_brought_up_and_answers(foreign: Foreign, name: str) -> None:
    node, master = foreign(name)
    master.bring_up()
    assert master.image.working_counter == 1
    for _ in range(50):
        master.tick(lambda: None)
    assert not master.image.lost.any()
    assert set(master.counted()) <= {"frames", "stale", "misses"}, master.counted()
    assert node.node.sdo[0x1017].raw == 100  # it was configured, and read back
    assert node.enabled_outputs == 0


def fails(
    foreign: tuple[ForeignNode, Master],
    error: type[BringupError],
    match: str,
    deadlines: Deadlines = DEADLINES,
) -> None:
    node, master = foreign
    with pytest.raises(error, match=match):
        master.bring_up(deadlines)
    assert node.enabled_outputs == 0  # nothing was told to move
    assert node.node.nmt.state != "OPERATIONAL" or error is StartError


@pytest.mark.parametrize(
    ("index", "subindex", "value", "match"),
    [
        (0x1018, 1, 0x1234, r"joint1 \(node 1\), object 1018h:01: expected .*got 4660 .*Another device"),
        (0x1018, 3, 7, r"1018h:03: expected 65536.*got 7 "),
        (0x1A00, 3, 0x60640020, r"1A00h:03: expected .*0x60410010.*got .*0x60640020.*Let the device map"),
        (0x1A00, 0, 2, r"1A00h:00: expected 9 .*got 2 "),
        (0x6076, 0, 5, r"6076h:00: expected 100000 .*got 5 .*SI units depends"),
        (0x1800, 1, 0x80000181, r"1800h:01: expected 385 .*got .*0x80000181"),
    ],
)
def test_one_that_is_something_else_is_refused(
    foreign: Foreign, index: int, subindex: int, value: int, match: str
) -> None:
    pair = foreign("joint1")
    pair[0].preset(index, subindex, value)
    fails(pair, MismatchError, match)


def test_one_with_the_eds_of_another_device_is_refused_by_its_name(foreign: Foreign) -> None:
    imu = str(resources.files("hapticd.configs") / "imu.eds")
    pair = foreign("ft", imu)
    fails(
        pair, MismatchError, r"ft \(node 9\), object 1008h:00: .*force-torque.*got .*inertial.*is not its EDS"
    )


def test_one_that_lacks_an_object_is_named_with_the_object(foreign: Foreign) -> None:
    pair = foreign("joint1")
    del pair[0].node.object_dictionary[0x2102]
    fails(pair, TransferError, r"joint1: node 1, object 2102h:00: aborted with 0x06020000 \(Object does not")


def test_one_that_aborts_is_named_with_the_code(foreign: Foreign) -> None:
    pair = foreign("ft")

    def refuse(**_: object) -> None:
        raise canopen.SdoAbortedError(0x08000022)

    pair[0].node.add_write_callback(refuse)
    fails(pair, TransferError, r"ft: node 9, object 1017h:00: aborted with 0x08000022")


def test_one_that_keeps_no_setting_is_refused(foreign: Foreign) -> None:
    pair = foreign("joint1")
    pair[0].node.add_read_callback(lambda index, **_: 5 if index == 0x2102 else None)
    fails(pair, MismatchError, r"2102h:00: expected 20 .*got 5 .*did not keep the setting")


def test_one_that_does_not_boot_is_missing(foreign: Foreign) -> None:
    pair = foreign("joint1")
    pair[0].network.unsubscribe(0x000, pair[0]._nmt)  # the package alone sends no boot-up message
    fails(
        pair,
        MissingDevicesError,
        r"no boot-up message within 50 ticks from joint1 \(node 1\)\. Check .*CAN FD",
        Deadlines(boot=50, response=1000, configuration=10_000, start=500),
    )


def test_one_without_sdo_server_is_silent(foreign: Foreign) -> None:
    pair = foreign("joint1")
    pair[0].network.unsubscribe(0x601)
    fails(
        pair,
        SilentDeviceError,
        r"joint1 \(node 1\) gave no answer for object 1008h:00 within 50 ticks",
        Deadlines(boot=1500, response=50, configuration=10_000, start=500),
    )


def test_one_that_answers_no_sync_is_named(foreign: Foreign) -> None:
    pair = foreign("joint1")
    pair[0].network.unsubscribe(0x080, pair[0]._sync)
    fails(pair, StartError, r"not in SAFEOP within 500 ticks after NMT start: joint1 \(UNKNOWN\)")


def test_one_whose_tpdo_has_another_length_is_named_and_counted(foreign: Foreign) -> None:
    pair = foreign("joint1")
    pair[0].tpdo_length = 8  # as a classic frame
    fails(pair, StartError, r"joint1 \(UNKNOWN\)")
    assert pair[1].counted()["length"] > 0


def test_one_that_speaks_classic_can_only_never_hears_us(devices: list[Device]) -> None:
    """On a real bus it would even destroy every CAN FD frame."""
    channel = f"node-{next(CHANNELS)}"
    master = Master(channel, devices[0])
    node = ForeignNode(devices[0], classic=True, channel=channel)
    try:
        fails(
            (node, master),
            MissingDevicesError,
            r"no boot-up .*joint1 .*that it speaks CAN FD",
            Deadlines(boot=200, response=1000, configuration=10_000, start=500),
        )
    finally:
        node.close()
        master.bus.close()


def test_a_text_padded_with_zeros_and_numbers_without_their_size_are_understood(foreign: Foreign) -> None:
    """As devices do that answer with whole words: CiA 301 lets a server leave the size out."""
    node, master = foreign("joint1")
    server = node.node.sdo
    respond = server.send_response

    def whole_words(response: bytearray) -> None:
        if response[0] & 0xE2 == 0x42:  # an expedited upload
            response[0] = 0x42
        respond(response)

    server.send_response = whole_words
    node.preset(0x1008, 0, "hapticd joint drive\0\0\0")
    master.bring_up()
    assert master.image.working_counter == 1


def test_a_foreign_drive_that_never_enables_stops_the_walk_and_is_named(foreign: Foreign) -> None:
    node, master = foreign("joint1")
    node.inputs = struct.pack("<HB", 0x40, 10)  # switch on disabled, in its mode of operation; and stays so
    master.bring_up()
    power = PowerStage(master.image, ["joints"], deadline=50)
    power.request(State.OPERATION_ENABLED)
    master.image["joints.target_torque"][:] = 5.0
    with pytest.raises(TransitionError, match=r"joint1 \(node 1\) did not make transition 2: "):
        for _ in range(1000):
            master.tick(power.step, operational=True)
