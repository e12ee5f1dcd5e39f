"""Whether another process wants the processor and does not get it."""

from __future__ import annotations

import os
from pathlib import Path


class Starvation:
    """Watches one process: runnable, and yet its running time stands still.

    The kernel brings the running time of a process that runs up to date a few hundred times a second only, so
    one that runs on may look starved for some milliseconds; then it is seen to have run.

    Attributes:
        ran_s: how long it ran between the last two looks [s].
    """

    def __init__(self, pid: int, proc: Path = Path("/proc")) -> None:
        self._files = []
        try:
            for name in ("stat", "schedstat"):
                self._files.append(os.open(proc / str(pid) / name, os.O_RDONLY | os.O_CLOEXEC))
        except OSError:  # a kernel without these tells nothing: nobody starves
            self._files = []
        self._ran = 0
        self.ran_s = 0.0

    def now(self, fresh: bool) -> bool:
        """Whether the process is runnable and did not run since the last call; ``fresh``: there was none."""
        try:
            stat, schedstat = (os.pread(file, 1024, 0) for file in self._files)
        except (OSError, ValueError):  # it is gone
            return False
        runnable = stat.rpartition(b")")[2].split()[0] == b"R"
        before, self._ran = self._ran, int(schedstat.split()[0])
        self.ran_s = (self._ran - before) / 1e9
        return runnable and (fresh or self._ran == before)
