"""A session over python-can in one process and virtual time, and a bus that misbehaves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import count
from typing import Any

import can
import pytest
from hapticd.devices.image import COUNTERS
from hapticd.devices.python_can import PythonCanAdapter, python_can
from hapticd.runtime.core.modes import Command, Mode

from .conftest import Bench

CHANNELS = count()
WATCHDOG_TICKS = 20


class Session:
    """A bench whose two ends are on a virtual bus of python-can."""

    def __init__(self, machine: str, echo: bool = False) -> None:
        channel = f"session-{next(CHANNELS)}"
        self.bench = Bench(machine=machine)
        bus = can.Bus(interface="virtual", channel=channel, receive_own_messages=echo)
        self.daemon, self.plant = PythonCanAdapter(bus), python_can("virtual", channel)
        self.stranger = can.Bus(interface="virtual", channel=channel)
        self.bench.lockstep._daemon = self.daemon  # type: ignore[assignment]
        self.bench.lockstep._bus = self.plant  # type: ignore[assignment]

    def counted(self, name: str) -> int:
        return int(self.bench.cycle.image.counters[COUNTERS.index(name)])

    def close(self) -> None:
        for end in (self.daemon, self.plant):
            end.close()
        self.stranger.shutdown()


Start = Callable[..., Session]


@pytest.fixture
def start(machine: str) -> Iterator[Start]:
    sessions: list[Session] = []

    def begin(**options: Any) -> Session:
        sessions.append(Session(machine, **options))
        return sessions[-1]

    yield begin
    for session in sessions:
        session.close()


def test_a_whole_life_over_a_virtual_bus(start: Start) -> None:
    session = start()
    bench = session.bench
    bench.until(Mode.ENGAGING)
    assert not bench.safe
    bench.until(Mode.ACTIVE, limit=4000)
    bench.run(1, Command.END)
    bench.until(Mode.STOPPED)
    assert bench.safe
    assert session.daemon.unsent == session.daemon.malformed == session.counted("foreign") == 0


def test_its_own_echo_is_no_second_master(start: Start) -> None:
    session = start(echo=True)
    session.bench.until(Mode.ENGAGING)
    session.bench.run(200)
    assert session.bench.mode is Mode.ENGAGING
    assert session.counted("foreign") == 0


def test_frames_that_are_no_data_frames_of_ours_are_counted_and_move_nothing(start: Start) -> None:
    session = start()
    bench = session.bench
    bench.until(Mode.ENGAGING)
    for _ in range(50):
        session.stranger.send(
            can.Message(arbitration_id=0x181, is_extended_id=True, data=bytes(24), is_fd=True)
        )
        session.stranger.send(can.Message(arbitration_id=0x182, is_extended_id=False, is_remote_frame=True))
        session.stranger.send(can.Message(arbitration_id=0x04, is_error_frame=True))
        bench.run(1)
    assert bench.mode is Mode.ENGAGING
    assert session.counted("error_frames") == 50
    assert session.counted("unknown") == 100


def full(*_: object, **__: object) -> None:
    raise can.CanOperationError("transmit buffer full")


def test_a_queue_that_is_full_for_three_ticks_is_ridden_out(start: Start) -> None:
    session = start()
    bench = session.bench
    bench.until(Mode.ENGAGING)
    send = session.daemon._bus.send
    session.daemon._bus.send = full  # type: ignore[method-assign]
    bench.run(3)
    session.daemon._bus.send = send  # type: ignore[method-assign]
    bench.run(50)
    assert bench.mode is Mode.ENGAGING
    assert session.daemon.unsent >= 3


def test_a_bus_that_takes_nothing_any_more_leaves_every_drive_safe_within_the_watchdog(start: Start) -> None:
    session = start()
    bench = session.bench
    bench.until(Mode.ENGAGING)
    bench.run(50)
    session.daemon._bus.send = full  # type: ignore[method-assign]
    bench.run(WATCHDOG_TICKS + 1)
    assert bench.safe
    assert not any(bench.torques)
    assert not bench.mode < Mode.STOPPING


def test_an_interface_that_disappears_leaves_every_drive_safe_and_the_stop_latched(start: Start) -> None:
    session = start()
    bench = session.bench
    bench.until(Mode.ENGAGING)
    bench.run(50)

    def gone(*_: object, **__: object) -> None:
        raise OSError(19, "No such device")

    session.daemon._bus.send = session.daemon._bus.recv = gone  # type: ignore[assignment, method-assign]
    bench.run(WATCHDOG_TICKS + 1)
    assert session.daemon.closed
    assert bench.safe
    bench.run(1000)
    assert not bench.mode.powered
    assert bench.reason
    assert bench.safe


def test_a_second_master_is_still_heard_beside_the_echo(start: Start) -> None:
    session = start(echo=True)
    bench = session.bench
    bench.until(Mode.ENGAGING)
    for _ in range(10):
        session.stranger.send(
            can.Message(arbitration_id=0x80, is_extended_id=False, data=bytes(48), is_fd=True)
        )
        bench.run(1)
    assert bench.reason == "second_master"
