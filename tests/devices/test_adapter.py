"""The same session over every adapter: bring-up, enabling, running, end of file."""

from __future__ import annotations

import errno
import socket
import struct
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from hapticd.devices import socket_adapter
from hapticd.devices.adapter import Adapter, memory_pair
from hapticd.devices.bringup import Bringup, BringupState
from hapticd.devices.cia402 import PowerStage, State
from hapticd.devices.device import Device
from hapticd.devices.errors import AdapterError
from hapticd.devices.frames import Frames
from hapticd.devices.image import ProcessImage
from hapticd.devices.network import Network
from hapticd.devices.python_can import PythonCanAdapter, python_can
from hapticd.devices.socket_adapter import (
    SocketAdapter,
    socketcan,
    unix_pair,
)
from hapticd.sim.nodes import SimNodes

Pair = tuple[Adapter, Adapter]


def vcan_pair() -> Pair:
    try:
        return socketcan("vcan0"), socketcan("vcan0")
    except AdapterError as error:
        pytest.skip(str(error))


@pytest.fixture(params=["memory", "unix pair", "python-can", "vcan"])
def pair(request: pytest.FixtureRequest) -> Iterator[Pair]:
    pairs = {
        "memory": lambda: memory_pair(),
        "unix pair": lambda: unix_pair(),
        "python-can": lambda: (python_can("virtual", "session"), python_can("virtual", "session")),
        "vcan": vcan_pair,
    }
    here, there = pairs[request.param]()
    yield here, there
    here.close()
    there.close()


def test_a_whole_session_runs_over_it(pair: Pair, devices: list[Device]) -> None:
    master, plant = pair
    image = ProcessImage(Network(devices))
    nodes = SimNodes(image.network)
    bringup = Bringup(image)
    power = PowerStage(image, ["joints", "axes"], deadline=50)
    power.request(State.OPERATION_ENABLED)
    incoming, outgoing, at_plant, answers = Frames(), Frames(), Frames(), Frames()
    image["joints.target_torque"][:] = 3.0
    for counter in range(70000, 70300):
        master.receive(incoming)
        image.latch(incoming, counter - 1)
        outgoing.clear()
        ready = bringup.step(incoming, outgoing) is BringupState.READY
        if ready:
            power.step()
        image.compose(outgoing, counter, operational=ready)
        master.send(outgoing)
        plant.receive(at_plant)
        answers.clear()
        nodes.receive(at_plant, answers)
        plant.send(answers)
        nodes.advance(1e-3)
        if power.ready:
            break
    assert power.ready
    assert image.working_counter == 12
    assert nodes["joint6"].torque == pytest.approx(3.0)  # type: ignore[attr-defined]
    assert master.unsent == plant.unsent == master.malformed == plant.malformed == 0


def test_receiving_where_nothing_waits_gives_nothing(pair: Pair) -> None:
    frames = Frames()
    frames.append(1, b"left over")
    assert pair[0].receive(frames) == 0
    assert len(frames) == 0
    assert not pair[0].closed


def test_frames_arrive_whole_and_in_order(pair: Pair) -> None:
    here, there = pair
    frames, received = Frames(), Frames()
    for i in range(20):
        frames.append(0x100 + i, bytes(range(i, i + 12)))
    here.send(frames)
    assert there.receive(received) == 20
    assert list(received) == list(frames)


def test_an_end_that_was_closed_says_so(pair: Pair) -> None:
    pair[0].close()
    assert pair[0].closed
    assert pair[0].receive(Frames()) == 0


@pytest.fixture(params=[True, False], ids=["batched", "single"])
def sockets(request: pytest.FixtureRequest) -> Iterator[tuple[SocketAdapter, socket.socket]]:
    """An adapter and its raw peer; ``single`` is how SocketCAN packs frames."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    adapter = SocketAdapter(ours)
    adapter._link.batched = request.param
    yield adapter, theirs
    adapter.close()
    theirs.close()


Sockets = tuple[SocketAdapter, socket.socket]
CLASSIC = struct.Struct("<IBBBB8s")


def test_end_of_file_is_reported_after_the_last_frame(sockets: Sockets) -> None:
    adapter, peer = sockets
    frames = Frames()
    frames.append(0x181, b"last words")
    peer.send(frames.array.tobytes())
    peer.close()
    received = Frames()
    assert adapter.receive(received) == 1
    assert received[0] == (0x181, b"last words")
    assert adapter.closed
    assert adapter.receive(received) == 0


def test_sending_to_a_peer_that_is_gone_is_counted_and_reported(sockets: Sockets) -> None:
    adapter, peer = sockets
    peer.close()
    frames = Frames()
    frames.append(1, b"")
    adapter.send(frames)
    assert adapter.closed
    assert adapter.unsent == 1
    assert adapter.error


def test_classic_frames_are_accepted(sockets: Sockets) -> None:
    adapter, peer = sockets
    peer.send(CLASSIC.pack(0x701, 1, 0xFF, 0, 0, b"\x05" + bytes(7)))
    frames = Frames()
    assert adapter.receive(frames) == 1
    assert frames[0] == (0x701, b"\x05")
    assert frames.array["flags"][0] == 0


@pytest.mark.parametrize("size", [1, 15, 17, 71, 73, 500])
def test_datagrams_that_are_no_frames_are_counted(sockets: Sockets, size: int) -> None:
    adapter, peer = sockets
    peer.send(b"\x01" * size)
    peer.send(CLASSIC.pack(0x701, 9, 0, 0, 0, bytes(8)))
    peer.send(CLASSIC.pack(0x701, 1, 0, 0, 0, bytes(8)))
    frames = Frames()
    assert adapter.receive(frames) == 1
    assert adapter.malformed == 2


def test_bytes_behind_the_payload_are_cleared(sockets: Sockets) -> None:
    adapter, peer = sockets
    peer.send(b"\x81\x01\0\0\x02\x04\xff\xff" + b"\xee" * 64)
    frames = Frames()
    adapter.receive(frames)
    assert frames.array.tobytes() == b"\x81\x01\0\0\x02\x04\0\0\xee\xee" + bytes(62)


def test_what_the_peer_has_not_taken_yet_is_unread(sockets: Sockets) -> None:
    adapter, peer = sockets
    assert not adapter.unread
    frames = Frames()
    frames.append(1, b"")
    adapter.send(frames)
    assert adapter.unread
    peer.recv(100)
    assert not adapter.unread


def test_arrival_times_of_time_objects_are_the_kernel_s(sockets: Sockets) -> None:
    adapter, peer = sockets
    stamp = CLASSIC.pack(0x100, 6, 0, 0, 0, bytes(8))
    peer.send(stamp)
    frames = Frames()
    adapter.receive(frames)
    assert adapter.time_ns == 0  # not asked for
    adapter.stamp_arrivals()
    before = time.monotonic_ns()
    peer.send(stamp)
    after = time.monotonic_ns()
    time.sleep(0.02)  # a late look does not make it arrive later
    peer.send(CLASSIC.pack(0x181, 0, 0, 0, 0, bytes(8)))
    assert adapter.receive(frames) == 2
    assert before - 1_000_000 <= adapter.time_ns <= after + 1_000_000
    adapter.receive(frames)
    assert adapter.time_ns == 0


def test_a_full_queue_drops_and_counts(sockets: Sockets) -> None:
    adapter, _ = sockets
    frames = Frames()
    for i in range(64):
        frames.append(i, b"")
    for _ in range(100):
        adapter.send(frames)
    assert adapter.unsent > 0
    assert not adapter.closed


def test_more_frames_than_fit_stay_for_the_next_call(sockets: Sockets) -> None:
    adapter, peer = sockets
    for i in range(70):
        peer.send(CLASSIC.pack(i, 0, 0, 0, 0, bytes(8)))
    frames = Frames()
    assert adapter.receive(frames) == 64
    assert adapter.receive(frames) == 6
    assert [can_id for can_id, _ in frames] == list(range(64, 70))
    big = Frames(capacity=200)
    for i in range(130):
        peer.send(CLASSIC.pack(i, 0, 0, 0, 0, bytes(8)))
    assert adapter.receive(big) == 130


@pytest.mark.parametrize("sockets", [True], indirect=True)
def test_a_batch_arrives_whole_and_one_that_does_not_fit_any_more_waits(sockets: Sockets) -> None:
    adapter, peer = sockets
    other = SocketAdapter(peer)
    for first in (0, 40):
        batch = Frames()
        for i in range(first, first + 40):
            batch.append(i, bytes([i]))
        other.send(batch)
    frames = Frames()
    assert adapter.receive(frames) == 40
    assert adapter.receive(frames) == 40
    assert [(can_id, data[0]) for can_id, data in frames] == [(i, i) for i in range(40, 80)]
    assert adapter.receive(frames) == 0


@pytest.mark.parametrize("sockets", [True], indirect=True)
def test_a_broken_frame_in_a_batch_is_dropped_and_the_others_are_kept(sockets: Sockets) -> None:
    adapter, peer = sockets
    whole = b"\x81\x01\0\0\x02\x04\0\0" + bytes(64)
    broken = whole[:4] + b"\x41" + whole[5:]  # 65 bytes of data
    peer.send(whole + broken + whole)
    frames = Frames()
    assert adapter.receive(frames) == 2
    assert adapter.malformed == 1
    assert [can_id for can_id, _ in frames] == [0x181, 0x181]


def test_a_flood_of_garbage_does_not_hold_the_receiver(sockets: Sockets) -> None:
    adapter, peer = sockets
    for _ in range(100):
        peer.send(b"garbage")
    peer.send(CLASSIC.pack(0x701, 0, 0, 0, 0, bytes(8)))
    frames = Frames()
    assert adapter.receive(frames) == 0
    assert adapter.malformed == 64
    assert adapter.receive(frames) == 1


def test_a_full_inbox_in_memory_drops_and_counts() -> None:
    here, there = memory_pair(capacity=4)
    frames = Frames()
    for i in range(3):
        frames.append(i, b"")
    here.send(frames)
    here.send(frames)
    assert here.unsent == 3
    assert there.receive(frames) == 3
    assert here.fileno() == -1


def test_a_kernel_without_socketcan_is_told_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> socket.socket:
        raise OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol")

    monkeypatch.setattr(socket_adapter.socket, "socket", refuse)
    with pytest.raises(AdapterError, match=r"can0: this kernel has no SocketCAN.*sudo modprobe can-raw"):
        socketcan("can0")


def test_socketcan_opens_or_says_what_is_missing() -> None:
    with pytest.raises(AdapterError, match=r"no SocketCAN|no such interface"):
        socketcan("nocan9")


@pytest.mark.parametrize(
    ("flags", "mtu", "match"),
    [
        (None, None, "no such interface.*sudo ip link add dev can0 type vcan"),
        ("0x40081", "16", "not in CAN FD mode.*mtu 16, not 72.*dbitrate 5000000 fd on"),
        ("0x40080", "72", "is down.*sudo ip link set can0 up"),
        ("0x40081", "72", None),
    ],
)
def test_an_interface_that_could_never_carry_a_frame_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, flags: str | None, mtu: str | None, match: str | None
) -> None:
    monkeypatch.setattr(socket_adapter, "_INTERFACES", tmp_path)
    if flags and mtu:
        (tmp_path / "can0").mkdir()
        (tmp_path / "can0" / "flags").write_text(flags + "\n")
        (tmp_path / "can0" / "mtu").write_text(mtu + "\n")
    if match is None:
        socket_adapter._check_interface("can0")
    else:
        with pytest.raises(AdapterError, match=match):
            socket_adapter._check_interface("can0")


def test_an_interface_that_python_can_does_not_have_is_refused() -> None:
    with pytest.raises(
        AdapterError, match=r"pcam: .*no such interface.*mean \"pcan\".*It has: .*udp_multicast"
    ):
        python_can("pcam", "can0")


def test_python_can_marks_what_is_no_standard_data_frame() -> None:
    sender = can.Bus(interface="virtual", channel="marks", fd=True)
    adapter = python_can("virtual", "marks")
    sender.send(can.Message(arbitration_id=0x181, is_extended_id=True, data=b"\x01"))
    sender.send(can.Message(arbitration_id=0x181, is_extended_id=False, is_remote_frame=True))
    sender.send(can.Message(arbitration_id=0x40, is_error_frame=True))
    frames = Frames()
    adapter.receive(frames)
    assert [hex(can_id) for can_id, _ in frames] == ["0x80000181", "0x40000181", "0x20000040"]
    adapter.close()
    sender.shutdown()


def test_a_python_can_interface_that_fails_is_closed() -> None:
    class Broken(can.BusABC):
        def __init__(self) -> None:
            self._is_shutdown = False
            self._periodic_tasks = []

        def _recv_internal(self, timeout: float | None) -> tuple[None, bool]:
            raise can.CanOperationError("unplugged")

        def send(self, msg: can.Message, timeout: float | None = None) -> None:
            raise can.CanOperationError("unplugged")

    adapter = PythonCanAdapter(Broken())
    frames = Frames()
    frames.append(1, b"")
    adapter.send(frames)
    assert adapter.unsent == 1
    assert adapter.receive(Frames()) == 0
    assert adapter.closed
    assert adapter.fileno() == -1
