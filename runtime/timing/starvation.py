"""Whether another process wants the processor and does not get it, or is not woken."""

from __future__ import annotations

import os
from pathlib import Path
from time import monotonic

EVENT_LOOPS = (b"ep_poll", b"do_epoll_wait")
"""Where in the kernel a process waits for events, by its name in several versions."""
LONGEST_DOZE_S = 0.1
"""A process that waits for events longer than this was not left asleep by its host."""


class Starvation:
    """Watches one process: runnable, or asleep in its event loop, and yet its running time stands still.

    Where the host takes a virtual processor away, a timer of that processor does not expire: who waits for it
    in an event loop looks asleep, and is forgiven for ``LONGEST_DOZE_S``.

    The kernel brings the running time of a process that runs up to date a few hundred times a second only, so
    one that runs on may look starved for some milliseconds; then it is seen to have run.

    Attributes:
        ran_s: how long it ran between the last two looks [s].
    """

    def __init__(self, pid: int, proc: Path = Path("/proc")) -> None:
        self._files = []
        try:
            for name in ("stat", "schedstat", "wchan"):
                self._files.append(os.open(proc / str(pid) / name, os.O_RDONLY | os.O_CLOEXEC))
        except OSError:  # a kernel without these tells nothing: nobody starves
            self._files = []
        self._ran, self._since = 0, 0.0
        self.ran_s = 0.0

    def now(self, fresh: bool) -> bool:
        """Whether it wants to run and did not since the last call; ``fresh``: none before."""
        try:
            stat, schedstat, channel = (os.pread(file, 1024, 0) for file in self._files)
        except (OSError, ValueError):  # it is gone
            return False
        if fresh:
            self._since = monotonic()
        waits = stat.rpartition(b")")[2].split()[0] == b"R" or (
            channel in EVENT_LOOPS and monotonic() < self._since + LONGEST_DOZE_S
        )
        before, self._ran = self._ran, int(schedstat.split()[0])
        self.ran_s = (self._ran - before) / 1e9
        return waits and (fresh or self._ran == before)
