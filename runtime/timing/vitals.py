"""Health of the real-time process itself: memory that grows, pages that fault, threads that should not be."""

from __future__ import annotations

import os
from math import inf

import msgspec

from .._rt import ffi, lib
from .slack import pause

SETTLED_S = 60.0
"""From the start until memory must not grow any more."""
LOOK_S = 1.0
LOOK_NS = 200_000
"""What a look may take: it reads /proc."""


class Vitals(msgspec.Struct):
    """What the process did to itself.

    Attributes:
        minor_faults, major_faults: page faults since the machine was first armed.
        rss_growth_kib: resident memory gained since the first minute; in shorter sessions since the start.
        threads: most threads seen at once.
    """

    minor_faults: int = 0
    major_faults: int = 0
    rss_growth_kib: int = 0
    threads: int = 1


class VitalSigns:
    """Looks at the process once a second."""

    def __init__(self) -> None:
        self._usage = ffi.new("rt_usage *")
        self._armed: tuple[int, int] | None = None
        self._statm = os.open("/proc/self/statm", os.O_RDONLY | os.O_CLOEXEC)
        self._rss = self._resident()
        self.found = Vitals()

    def armed(self) -> None:
        """The machine is armed: from the first time on, page faults count."""
        if self._armed is None:
            self._armed = self._faults()

    def look(self) -> None:
        """Bring ``found`` up to date."""
        self._look_at_memory()
        self._look_at_threads()

    def settle(self) -> None:
        """Memory has its size from here on."""
        self._rss = self._resident()

    async def watch(self) -> None:
        """Supervisory work: a look a second, where there is time."""
        self.settle()
        settles_ns = float(lib.rt_now() + 1e9 * SETTLED_S)
        while True:
            await pause(LOOK_S)
            if lib.rt_now() >= settles_ns:
                self.settle()
                settles_ns = inf
            self._look_at_memory()
            await pause()
            self._look_at_threads()

    def _look_at_memory(self) -> None:
        if self._armed is not None:
            minor, major = self._faults()
            self.found.minor_faults = minor - self._armed[0]
            self.found.major_faults = major - self._armed[1]
        self.found.rss_growth_kib = self._resident() - self._rss

    def _look_at_threads(self) -> None:
        self.found.threads = max(self.found.threads, len(os.listdir("/proc/self/task")))

    def _faults(self) -> tuple[int, int]:
        lib.rt_usage_read(self._usage)
        return self._usage.minor_faults, self._usage.major_faults

    def _resident(self) -> int:
        pages = int(os.pread(self._statm, 128, 0).split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") // 1024
