"""Tells the service manager how the daemon is: the datagrams of sd_notify(3), without its library."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable, Mapping
from typing import Protocol

LONGEST_INTERVAL_S = 1.0


class ServiceManager:
    """Who started the daemon and listens on NOTIFY_SOCKET; where nobody does, telling is a no-op.

    Attributes:
        watchdog: time after which it takes a silent daemon for dead [s], None where it does not watch.
    """

    def __init__(self, environ: Mapping[str, str]) -> None:
        path = environ.get("NOTIFY_SOCKET", "")
        self._address = "\0" + path[1:] if path.startswith("@") else path
        self._socket: socket.socket | None = None
        if path[:1] in ("/", "@"):
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        watched = environ.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        period = environ.get("WATCHDOG_USEC", "")
        self.watchdog = int(period) / 1e6 if watched and period.isdecimal() and int(period) else None

    @property
    def listens(self) -> bool:
        """Whether there is anybody to tell."""
        return self._socket is not None

    def tell(self, *assignments: str) -> None:
        """Send assignments like ``READY=1``; a manager that is gone or busy misses them."""
        if self._socket:
            try:
                self._socket.sendto("\n".join(assignments).encode(), self._address)
            except OSError:
                return

    def close(self) -> None:
        """No more is told."""
        if self._socket:
            self._socket.close()
            self._socket = None


class Timer(Protocol):
    """The part of an event loop that this needs."""

    def call_later(self, delay: float, callback: Callable[[], None]) -> asyncio.TimerHandle:
        """Calls back after a delay [s]."""


class Supervision:
    """Says READY with the first completed tick, and WATCHDOG only while ticks complete.

    It runs between the ticks, a few times per watchdog period: a loop that stalls does not come here, and
    one that runs without completing ticks has no progress to show.
    """

    def __init__(
        self, manager: ServiceManager, progress: Callable[[], int], status: Callable[[], str]
    ) -> None:
        self._manager, self._progress, self._status = manager, progress, status
        self._interval = min((manager.watchdog or float("inf")) / 4.0, LONGEST_INTERVAL_S)
        self._seen = progress()
        self._news = ["READY=1"]
        self._timer: asyncio.TimerHandle | None = None
        self._said = ""

    def start(self, loop: Timer) -> None:
        """Look after the ticks from now on."""
        if self._manager.listens:
            self._timer = loop.call_later(self._interval, lambda: self._look(loop))

    def stop(self) -> None:
        """The session ends; what remains to be done needs no watchdog."""
        if self._timer:
            self._timer.cancel()
        self._manager.tell("STOPPING=1")
        self._manager.close()

    def _look(self, loop: Timer) -> None:
        progress, status = self._progress(), self._status()
        if status != self._said:
            self._news.append(f"STATUS={status}")
            self._said = status
        if progress != self._seen:
            self._seen = progress
            self._manager.tell(*self._news, "WATCHDOG=1")
            self._news = []
        self.start(loop)
