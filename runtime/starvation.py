"""Whether another process wants the processor and does not get it."""

from __future__ import annotations

import os
from pathlib import Path


class Starvation:
    """Watches one process: runnable, and yet its running time stands still."""

    def __init__(self, pid: int, proc: Path = Path("/proc")) -> None:
        self._files = []
        try:
            for name in ("stat", "schedstat"):
                self._files.append(os.open(proc / str(pid) / name, os.O_RDONLY | os.O_CLOEXEC))
        except OSError:  # a kernel without these tells nothing: nobody starves
            self._files = []
        self._ran = -1

    def now(self) -> bool:
        """Whether the process starved since the last call."""
        try:
            stat, schedstat = (os.pread(file, 1024, 0) for file in self._files)
        except (OSError, ValueError):  # it is gone
            return False
        state = stat.rpartition(b")")[2].split()[0]
        before, self._ran = self._ran, int(schedstat.split()[0])
        return state == b"R" and self._ran == before
