"""The fixed-rate loop: a timerfd on uvloop, a plain callback a tick, an absolute phase grid."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable

from ._rt import lib
from .errors import HapticdError


class TimerError(HapticdError):
    """The kernel gives no timer."""

    code = "timer"


def now_ns() -> int:
    """CLOCK_MONOTONIC."""
    return int(lib.rt_now())


class FixedRate:
    """Calls back once a period, on the grid ``start + k period``.

    Expired periods that were not served are counted and skipped; the loop never runs after them.

    Attributes:
        tick: index on the grid of the running callback.
        skipped: grid points without a callback just before it.
        deadline_ns: of the running callback.
    """

    def __init__(self, period_ns: int, callback: Callable[[], None]) -> None:
        self.period_ns = period_ns
        self._callback = callback
        self._fd = -1
        self._start_ns = 0
        self.tick = -1
        self.skipped = 0
        self.deadline_ns = 0

    def start(self, loop: asyncio.AbstractEventLoop, delay_ns: int) -> int:
        """Begin after a delay; returns the time of tick 0.

        Raises:
            TimerError: the kernel refuses.
        """
        self._start_ns = now_ns() + delay_ns
        fd = int(lib.rt_timer_open(self._start_ns, self.period_ns))
        if fd < 0:
            raise TimerError(f"no timerfd: {os.strerror(-fd)}")
        self._fd = fd
        loop.add_reader(fd, self._expired)
        return self._start_ns

    def stop(self, loop: asyncio.AbstractEventLoop) -> None:
        """No callback comes after this."""
        if self._fd >= 0:
            loop.remove_reader(self._fd)
            os.close(self._fd)
            self._fd = -1

    def _expired(self) -> None:
        expirations = int(lib.rt_timer_read(self._fd))
        if expirations <= 0:
            return
        self.skipped = expirations - 1
        self.tick += expirations
        self.deadline_ns = self._start_ns + self.tick * self.period_ns
        self._callback()
