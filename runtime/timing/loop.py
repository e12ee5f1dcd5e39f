"""The fixed-rate loop: a timerfd on uvloop, a plain callback a tick, an absolute phase grid."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

from .._rt import lib
from ..errors import HapticdError
from .slack import Slack
from .watch import Watch


class TimerError(HapticdError):
    """The kernel gives no timer."""

    code = "timer"


def now_ns() -> int:
    """CLOCK_MONOTONIC."""
    return int(lib.rt_now())


class FixedRate:
    """Calls back once a period, on the grid ``start + k period``.

    Expired periods that were not served are counted and skipped; the loop never runs after them. With
    ``spin_ns`` the timer fires that much early and the rest is waited out busily in C: punctual to about
    a microsecond, at the price of a processor that is busy that long in every period.

    Attributes:
        tick: index on the grid of the running callback.
        skipped: grid points without a callback just before it.
        deadline_ns: of the running callback.
        slack: supervisory work that runs between the ticks.
    """

    def __init__(
        self, period_ns: int, callback: Callable[[], None], spin_ns: int = 0, slack: Slack | None = None
    ) -> None:
        self.period_ns, self.spin_ns = period_ns, spin_ns
        self.slack = slack or Slack(Watch())
        self._callback = callback
        self._fd = -1
        self._start_ns = 0
        self.tick = -1
        self.skipped = 0
        self.deadline_ns = 0

    def start(self, add_reader: Callable[[int, Callable[[], None]], Any], delay_ns: int) -> int:
        """Begin after a delay; returns the time of tick 0.

        Args:
            add_reader: of the event loop, see ``WatchedLoop.add_tick``.
            delay_ns: until tick 0.

        Raises:
            TimerError: the kernel refuses.
        """
        self._start_ns = now_ns() + delay_ns
        fd = int(lib.rt_timer_open(self._start_ns - self.spin_ns, self.period_ns))
        if fd < 0:
            raise TimerError(f"no timerfd: {os.strerror(-fd)}")
        self._fd = fd
        add_reader(fd, self._expired)
        return self._start_ns

    @property
    def running(self) -> bool:
        """Whether callbacks come."""
        return self._fd >= 0

    def shift(self, by_ns: int) -> None:
        """Move the grid; the present tick stays, the next one comes that much later."""
        self._start_ns += by_ns
        following = self._start_ns + (self.tick + 1) * self.period_ns
        lib.rt_timer_set(self._fd, following - self.spin_ns, self.period_ns)

    def stop(self, remove_reader: Callable[[int], Any]) -> None:
        """No callback comes after this."""
        if self._fd >= 0:
            remove_reader(self._fd)
            os.close(self._fd)
            self._fd = -1

    def _expired(self) -> None:
        expirations = int(lib.rt_timer_read(self._fd))
        if expirations <= 0:
            return
        self.skipped = expirations - 1
        self.tick += expirations
        self.deadline_ns = self._start_ns + self.tick * self.period_ns
        if self.spin_ns:
            lib.rt_spin(self.deadline_ns)
        self._callback()
        self.slack.serve(self.deadline_ns + self.period_ns - self.spin_ns)
