"""Writing to a terminal or pipe that may be hung, closed or slow, without ever waiting for it."""

from __future__ import annotations

import os
import select
import stat
import sys
from time import monotonic

MOST_PENDING = 1 << 16
"""Bytes that wait for a slow reader; what comes when they are too many is not shown."""
CHUNK = 512
"""Bytes of one write: whatever says it is ready takes as many as these at once."""


def reopened(fd: int, flags: int) -> int:
    """Another descriptor of the terminal or pipe behind ``fd``, which never waits.

    It has a file description of its own, because the shell shares that of ``fd`` and does not expect it to
    become non-blocking. A duplicate where there is no such thing, or no permission for it.
    """
    if stat.S_ISCHR(os.fstat(fd).st_mode) or stat.S_ISFIFO(os.fstat(fd).st_mode):
        try:
            return os.open(f"/proc/self/fd/{fd}", flags | os.O_NONBLOCK | os.O_NOCTTY)
        except OSError:
            pass
    return os.dup(fd)


class Outlet:
    """Takes text at any time and hands on what the reader takes.

    Attributes:
        gone: the reader is; nothing more is written.
    """

    def __init__(self, fd: int) -> None:
        """Text that the encoding of standard error lacks is written as escapes."""
        self._encoding = getattr(sys.stderr, "encoding", None) or "utf-8"
        self._pending = b""
        self._lost = 0
        self.gone = False
        try:
            self._fd = reopened(fd, os.O_WRONLY)
        except OSError:  # closed from the start
            self.gone = True

    @property
    def idle(self) -> bool:
        """Whether everything has been handed on."""
        return not self._pending

    def write(self, text: str) -> None:
        """Hand on a text, now or later."""
        data = text.encode(self._encoding, "backslashreplace")
        if len(self._pending) + len(data) > MOST_PENDING:
            self._lost += 1
        else:
            self._pending += data
        self.flush()

    def flush(self) -> None:
        """Hand on what the reader takes now."""
        while self._pending and not self.gone and self._ready(0.0):
            try:
                written = os.write(self._fd, self._pending[:CHUNK])
            except BlockingIOError:
                return
            except OSError:  # hung up, or nobody reads
                self.gone = True
                return
            self._pending = self._pending[written:]
        if not self._pending and self._lost:
            lost, self._lost = self._lost, 0
            self.write(f"hapticd: {lost} messages did not fit in here; the log has them\n")

    def close(self, patience_s: float) -> None:
        """Hand on the rest, but wait no longer than this [s]."""
        end = monotonic() + patience_s
        while self._pending and not self.gone and self._ready(end - monotonic()):
            self.flush()

    def _ready(self, wait_s: float) -> bool:
        poll = select.poll()
        poll.register(self._fd, select.POLLOUT)
        return bool(poll.poll(max(0.0, 1e3 * wait_s)))
