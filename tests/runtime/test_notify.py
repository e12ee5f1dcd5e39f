"""What the service manager hears: nothing before a tick completed, and no ping without progress."""

from __future__ import annotations

import asyncio
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hapticd.runtime.live.notify import LONGEST_INTERVAL_S, ServiceManager, Supervision


class Listener:
    """The manager's end, a real datagram socket."""

    def __init__(self, address: str) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self.socket.bind(address)

    def heard(self) -> list[str]:
        told = []
        while True:
            try:
                told.append(self.socket.recv(4096).decode())
            except BlockingIOError:
                return told


@pytest.fixture
def listener(tmp_path: Path) -> Iterator[Listener]:
    end = Listener(str(tmp_path / "notify"))
    yield end
    end.socket.close()


@pytest.fixture
def environ(tmp_path: Path) -> dict[str, str]:
    return {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "2000000"}


class ManualTimer:
    """Calls back when it is told to, and remembers the delays."""

    def __init__(self) -> None:
        self.delays: list[float] = []
        self.callback: Callable[[], None] | None = None

    def call_later(self, delay: float, callback: Callable[[], None]) -> ManualTimer:
        self.delays.append(delay)
        self.callback = callback
        return self

    def cancel(self) -> None:
        self.callback = None

    def fire(self) -> None:
        assert self.callback is not None
        self.callback()


def test_assignments_go_out_as_one_datagram(listener: Listener, environ: dict[str, str]) -> None:
    manager = ServiceManager(environ)
    assert manager.listens
    manager.tell("READY=1", "STATUS=on")
    assert listener.heard() == ["READY=1\nSTATUS=on"]
    manager.close()
    manager.tell("STOPPING=1")
    assert listener.heard() == []


def test_an_abstract_address_begins_with_an_at_sign() -> None:
    name = f"hapticd-test-{os.getpid()}"
    listener = Listener(f"\0{name}")
    manager = ServiceManager({"NOTIFY_SOCKET": f"@{name}"})
    manager.tell("READY=1")
    assert listener.heard() == ["READY=1"]
    manager.close()
    listener.socket.close()


@pytest.mark.parametrize("environ", [{}, {"NOTIFY_SOCKET": ""}, {"NOTIFY_SOCKET": "vsock:2:1"}])
def test_without_a_manager_telling_does_nothing(environ: dict[str, str]) -> None:
    manager = ServiceManager(environ)
    assert not manager.listens
    manager.tell("READY=1")
    timer = ManualTimer()
    supervision = Supervision(manager, lambda: 0, lambda: "READY")
    supervision.start(timer)  # type: ignore[arg-type]
    assert timer.callback is None
    supervision.stop()


def test_a_manager_that_is_gone_or_does_not_read_is_not_waited_for(
    listener: Listener, environ: dict[str, str]
) -> None:
    manager = ServiceManager(environ)
    for _ in range(10_000):
        manager.tell("STATUS=" + "x" * 1000)
    assert 0 < len(listener.heard()) < 10_000
    listener.socket.close()
    manager.tell("WATCHDOG=1")
    manager.close()


@pytest.mark.parametrize(
    ("changes", "watchdog"),
    [
        ({}, 2.0),
        ({"WATCHDOG_PID": str(os.getpid())}, 2.0),
        ({"WATCHDOG_PID": "1"}, None),
        ({"WATCHDOG_USEC": "0"}, None),
        ({"WATCHDOG_USEC": "soon"}, None),
        ({"WATCHDOG_USEC": ""}, None),
    ],
)
def test_the_watchdog_is_for_this_process_only(
    listener: Listener, environ: dict[str, str], changes: dict[str, str], watchdog: float | None
) -> None:
    manager = ServiceManager({**environ, **changes})
    assert manager.watchdog == watchdog
    manager.close()


def test_ready_comes_with_the_first_tick_and_pings_only_with_further_ones(
    listener: Listener, environ: dict[str, str]
) -> None:
    ticks, status = 0, "BRINGUP"
    timer = ManualTimer()
    supervision = Supervision(ServiceManager(environ), lambda: ticks, lambda: status)
    supervision.start(timer)  # type: ignore[arg-type]
    timer.fire()
    assert listener.heard() == []
    ticks = 500
    timer.fire()
    assert listener.heard() == ["READY=1\nSTATUS=BRINGUP\nWATCHDOG=1"]
    ticks, status = 1000, "ACTIVE"
    timer.fire()
    assert listener.heard() == ["STATUS=ACTIVE\nWATCHDOG=1"]
    ticks = 1500
    timer.fire()
    assert listener.heard() == ["WATCHDOG=1"]
    for _ in range(5):  # the timer runs, the ticks do not
        timer.fire()
    assert listener.heard() == []
    supervision.stop()
    assert listener.heard() == ["STOPPING=1"]
    assert timer.callback is None
    assert set(timer.delays) == {0.5}  # four looks within the watchdog's period


def test_status_is_told_without_a_watchdog_too(listener: Listener, environ: dict[str, str]) -> None:
    del environ["WATCHDOG_USEC"]
    timer = ManualTimer()
    supervision = Supervision(ServiceManager(environ), lambda: len(timer.delays), lambda: "ACTIVE")
    supervision.start(timer)  # type: ignore[arg-type]
    assert timer.delays == [LONGEST_INTERVAL_S]
    timer.fire()
    assert listener.heard() == ["READY=1\nSTATUS=ACTIVE\nWATCHDOG=1"]
    supervision.stop()


async def test_a_loop_that_is_blocked_does_not_ping(listener: Listener, environ: dict[str, str]) -> None:
    environ["WATCHDOG_USEC"] = "20000"
    ticks = iter(range(1_000_000))
    supervision = Supervision(ServiceManager(environ), lambda: next(ticks), lambda: "ACTIVE")
    supervision.start(asyncio.get_running_loop())
    await asyncio.sleep(0.1)
    assert len(listener.heard()) > 1
    blocked = subprocess.run(["sleep", "0.1"], check=True)  # the loop does not turn here
    assert blocked.returncode == 0
    assert listener.heard() == []
    supervision.stop()


def test_the_daemon_tells_its_manager_from_the_first_tick_to_the_last(
    listener: Listener, environ: dict[str, str], tmp_path: Path
) -> None:
    command = [sys.executable, "-m", "hapticd.runtime", "run", "giant", "--duration", "1.5"]
    ended = subprocess.run(
        [*command, "--log", str(tmp_path / "session.mcap")],
        env={**os.environ, **environ},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    heard = listener.heard()
    assert heard[0].startswith("READY=1\nSTATUS=")
    assert sum("WATCHDOG=1" in text for text in heard) >= 2
    assert any("STATUS=ENGAGING" in text for text in heard)
    assert heard[-1] == "STOPPING=1"
