"""Interfaces of python-can: what opens, what is refused and why, and drivers that misbehave."""

from __future__ import annotations

import gc
import socket
import sys
import types
from collections.abc import Iterator
from typing import Any

import can
import pytest
from can.interfaces import BACKENDS
from hapticd.devices import python_can as module
from hapticd.devices.errors import AdapterError
from hapticd.devices.frames import Frames
from hapticd.devices.python_can import PythonCanAdapter, missing_packages, prepare, python_can

MADE: list[dict[str, Any]] = []


class Recording(can.BusABC):
    """A driver that only notes how it was opened."""

    def __init__(self, channel: Any, **kwargs: Any) -> None:
        """Takes everything.

        :param bool fd: CAN FD.
        :param int bitrate: bit/s.
        :param int data_bitrate: bit/s.
        :param str serial: of the adapter.
        """
        self._is_shutdown = False
        self._periodic_tasks = []
        self.sent: list[can.Message] = []
        MADE.append({"channel": channel, **kwargs})

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return None, True

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.sent.append(msg)


class Timed(Recording):
    """As PCAN has it: a bit timing instead of a data bit rate."""

    def __init__(self, channel: Any, bitrate: int = 500000, timing: Any = None, **kwargs: Any) -> None:
        """Takes a timing.

        :param bool fd: CAN FD.
        """
        super().__init__(channel, bitrate=bitrate, timing=timing, **kwargs)


class Classic(Recording):
    """Without CAN FD."""

    def __init__(self, channel: Any, bitrate: int = 500000, **kwargs: Any) -> None:
        """Takes a bit rate, and swallows what it does not know."""
        super().__init__(channel, bitrate=bitrate, **kwargs)


class Driverless(Recording):
    """Its maker's library is missing."""

    def __init__(self, channel: Any, **kwargs: Any) -> None:
        """Fails as Kvaser's does.

        :param bool fd: CAN FD.
        """
        raise NameError("name 'canGetNumberOfChannels' is not defined")


class Halfway(can.BusABC):
    """Fails after its base was made, as udp_multicast does where the channel is no address."""

    def __init__(self, channel: Any, **kwargs: Any) -> None:
        """Fails.

        :param bool fd: CAN FD.
        """
        super().__init__(channel, **kwargs)
        raise OSError("Name or service not known")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return None, True

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise AssertionError

    def shutdown(self) -> None:
        raise AttributeError("what the rest of the constructor would have made")


@pytest.fixture(autouse=True)
def drivers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drivers of our own beside python-can's."""
    MADE.clear()
    monkeypatch.setitem(sys.modules, "drivers_of_ours", types.SimpleNamespace(**globals()))
    for kind in (Recording, Timed, Classic, Driverless, Halfway):
        monkeypatch.setitem(BACKENDS, kind.__name__.lower(), ("drivers_of_ours", kind.__name__))


def test_bit_rates_and_settings_reach_the_driver() -> None:
    python_can("recording", 3, 1_000_000, 5_000_000, {"serial": "4711"}).close()
    assert MADE == [
        {"channel": 3, "fd": True, "bitrate": 1_000_000, "data_bitrate": 5_000_000, "serial": "4711"}
    ]


def test_without_bit_rates_the_driver_keeps_its_own() -> None:
    python_can("recording", "ch").close()
    assert MADE == [{"channel": "ch", "fd": True}]


def test_bit_rates_become_a_bit_timing_where_a_driver_wants_one() -> None:
    python_can("timed", "ch", 1_000_000, 5_000_000).close()
    timing = MADE[0]["timing"]
    assert isinstance(timing, can.BitTimingFd)
    assert (timing.nom_bitrate, timing.data_bitrate) == (1_000_000, 5_000_000)
    assert timing.nom_sample_point == pytest.approx(80.0, abs=1.0)
    assert timing.data_sample_point == pytest.approx(75.0, abs=1.0)


def test_pcan_takes_a_bit_timing() -> None:
    arguments = prepare("pcan", 1_000_000, 5_000_000, {})[1]
    assert arguments["timing"].data_bitrate == 5_000_000


def test_what_a_configuration_file_of_python_can_says_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CAN_BITRATE", "125000")
    monkeypatch.setitem(can.rc, "data_bitrate", 500000)
    python_can("recording", "ch").close()
    assert MADE == [{"channel": "ch", "fd": True}]


@pytest.mark.parametrize(
    ("interface", "rates", "settings", "match"),
    [
        (
            "recordin",
            (None, None),
            {},
            r'recordin: .*no such interface\. Did you mean "recording"\? It has: ',
        ),
        ("recording", (None, None), {"serail": 1}, r"no setting 'serail'\. Did you mean \"serial\"\?"),
        ("recording", (None, None), {"fd": False}, r"no setting 'fd'\. .*It has: serial"),
        ("timed", (1_000_000, None), {}, r"one bit rate is missing\. Give bitrate and data_bitrate"),
        ("timed", (999_983, 4_999_999), {}, r"no bit timing gives 999983 and 4999999 bit/s"),
        ("classic", (None, None), {}, r"carries no CAN FD"),
        ("virtual", (1_000_000, None), {}, r"takes no bitrate\. Leave it out of \[bus\]"),
        ("driverless", (None, None), {}, r"driverless:ch: .*canGetNumberOfChannels.*driver of its maker"),
    ],
)
def test_what_cannot_work_is_refused_with_what_does(
    interface: str, rates: tuple[int | None, int | None], settings: dict[str, Any], match: str
) -> None:
    with pytest.raises(AdapterError, match=match):
        python_can(interface, "ch", *rates, settings)


def test_a_package_that_an_interface_needs_is_named_with_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("can.interfaces.udp_multicast.utils.msgpack", None)
    monkeypatch.setattr(module, "_installed", lambda package: package != "msgpack")
    assert missing_packages("udp_multicast") == ["msgpack"]
    with pytest.raises(AdapterError) as refused:
        python_can("udp_multicast", "239.74.163.2")
    assert (
        refused.value.remedy
        == f"It needs msgpack: type {sys.executable} -m pip install 'python-can[multicast]'"
    )
    assert missing_packages("virtual") == []


@pytest.fixture
def pair() -> Iterator[tuple[can.BusABC, PythonCanAdapter]]:
    far = can.Bus(interface="virtual", channel="misbehaviour")
    adapter = python_can("virtual", "misbehaviour")
    yield far, adapter
    adapter.close()
    far.shutdown()


Pair = tuple[can.BusABC, PythonCanAdapter]


def test_its_own_echo_is_dropped_and_an_equal_frame_of_another_is_not(pair: Pair) -> None:
    far, _ = pair
    echoing = PythonCanAdapter(
        can.Bus(interface="virtual", channel="misbehaviour", receive_own_messages=True)
    )
    frames, received = Frames(), Frames()
    frames.append(0x80, b"\x01\x00\x00\x00")
    echoing.send(frames)
    assert echoing.receive(received) == 0
    message = far.recv(0)
    assert message is not None
    far.send(message)
    assert echoing.receive(received) == 1
    echoing.close()


def test_over_udp_multicast_it_does_not_hear_itself_and_garbage_is_no_end() -> None:
    pytest.importorskip("msgpack")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", 0))
        port = other.getsockname()[1]
    try:
        here = python_can("udp_multicast", "239.74.163.2", settings={"port": port})
        there = python_can("udp_multicast", "239.74.163.2", settings={"port": port})
    except AdapterError as error:
        pytest.skip(str(error))
    frames, received = Frames(), Frames()
    for i in range(3):
        frames.append(0x181 + i, bytes(24))
    there.send(frames)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for _ in range(5):
            stranger.sendto(b"garbage", ("239.74.163.2", port))
    here.send(frames)
    try:
        heard: list[int] = []
        for _ in range(2000):
            here.receive(received)
            heard += [can_id for can_id, _ in received]
        if not heard:
            pytest.skip("no multicast on this host")
        assert heard == [0x181, 0x182, 0x183]
        assert here.malformed == 5
        assert not here.closed
    finally:
        here.close()
        there.close()


def test_a_full_queue_costs_the_frames_that_did_not_fit_and_no_others(pair: Pair) -> None:
    far, adapter = pair
    send, turns = adapter._bus.send, iter(range(100))

    def full(message: can.Message, timeout: float | None = None) -> None:
        if next(turns) % 2:
            raise can.CanOperationError("transmit buffer full")
        send(message, timeout)

    adapter._bus.send = full  # type: ignore[method-assign]
    frames = Frames()
    for i in range(4):
        frames.append(0x101 + i, b"")
    adapter.send(frames)
    assert adapter.unsent == 2
    assert not adapter.closed
    first, second = far.recv(0), far.recv(0)
    assert first is not None and second is not None
    assert (first.arbitration_id, second.arbitration_id) == (0x101, 0x103)


@pytest.mark.parametrize(
    "error", [can.CanOperationError("bus off"), OSError(19, "No such device"), TypeError()]
)
def test_one_that_was_pulled_out_is_closed_at_once_whatever_its_driver_raises(
    pair: Pair, error: Exception
) -> None:
    _, adapter = pair

    def gone(*_: object, **__: object) -> None:
        raise error

    adapter._bus.recv = adapter._bus.send = gone  # type: ignore[assignment, method-assign]
    frames = Frames()
    frames.append(0x80, b"")
    adapter.send(frames)
    assert adapter.unsent == 1
    assert adapter.receive(frames) == 0
    assert adapter.closed


def test_sixty_three_failures_in_a_row_are_malformed_messages_and_the_next_is_the_end(pair: Pair) -> None:
    _, adapter = pair
    left = 63

    def receive(timeout: float) -> None:
        nonlocal left
        left -= 1
        if left >= 0:
            raise can.CanOperationError("could not unpack received message")

    adapter._bus.recv = receive  # type: ignore[assignment, method-assign]
    adapter.receive(Frames())
    assert (adapter.malformed, adapter.closed) == (63, False)
    left = 64
    adapter.receive(Frames())
    assert adapter.closed


def test_one_that_cannot_be_shut_down_any_more_is_closed_all_the_same(pair: Pair) -> None:
    _, adapter = pair
    shutdown = adapter._bus.shutdown

    def gone() -> None:
        shutdown()
        raise OSError(19, "No such device")

    adapter._bus.shutdown = gone  # type: ignore[method-assign]
    adapter.close()
    adapter.close()
    assert adapter.closed


def test_a_failed_interface_is_shut_down_when_it_is_closed(pair: Pair) -> None:
    _, adapter = pair
    adapter._bus.recv = lambda timeout: 1 / 0  # type: ignore[method-assign, assignment]
    adapter.receive(Frames())
    assert adapter.closed
    adapter.close()
    assert adapter._bus._is_shutdown


def test_frames_that_no_bus_carries_are_counted_and_others_are_masked(pair: Pair) -> None:
    far, adapter = pair
    far.send(can.Message(arbitration_id=1, data=bytes(80), check=False))
    far.send(can.Message(arbitration_id=1 << 40 | 0x40, is_error_frame=True, check=False))
    frames = Frames()
    adapter.receive(frames)
    assert [hex(can_id) for can_id, _ in frames] == ["0x20000040"]
    assert adapter.malformed == 1
    assert not adapter.closed


def test_a_bus_that_fails_halfway_is_not_left_open(caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(AdapterError, match="Name or service not known"):
        python_can("halfway", "nope")
    gc.collect()
    assert "not properly shut down" not in caplog.text


def test_a_channel_that_is_no_address_is_told_what_one_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BACKENDS, "udp_multicast", ("drivers_of_ours", "Halfway"))
    monkeypatch.setattr(module, "missing_packages", lambda interface: [])
    with pytest.raises(AdapterError, match=r"udp_multicast:nope: .*multicast group, e\.g\. 239\.74\.163\.2"):
        python_can("udp_multicast", "nope")
