"""The terminal that a session is typed at: keys arrive one by one, and its settings always come back."""

from __future__ import annotations

import os
import signal
import stat
import termios
from pathlib import Path
from typing import Any

from .outlet import reopened

STDIN = 0
BITE = 32
"""Bytes that are read at once: a flood of them must not keep a tick waiting."""
LFLAG, CC = 3, 6
"""Places of the local modes and of the special characters in what ``tcgetattr`` gives."""


class Keyboard:
    """What can be read from a descriptor without waiting.

    Attributes:
        fd: to be read.
    """

    def __init__(self, fd: int, single_keys: bool) -> None:
        """With ``single_keys`` a terminal gives every key at once and does not echo it."""
        self.fd = reopened(fd, os.O_RDONLY)
        self._single_keys = single_keys
        self._before: list[Any] | None = None

    def grab(self) -> None:
        """Set the terminal to single keys, while it is in front of this process; may be called again."""
        if self._single_keys and in_front(self.fd):
            found = saved(self.fd)
            if found and (self._before is None or found[LFLAG] & termios.ICANON):  # else they are our own
                self._before = found
            if self._before:
                modes = [*self._before]
                modes[LFLAG] &= ~(termios.ICANON | termios.ECHO)
                modes[CC] = [*modes[CC]]
                modes[CC][termios.VMIN], modes[CC][termios.VTIME] = 1, 0
                restore(self.fd, modes)

    def release(self) -> None:
        """Give the terminal back as it was."""
        if self._before:
            restore(self.fd, self._before)
            self._before = None

    def read(self) -> bytes | None:
        """What was typed; empty where nothing more comes, None where somebody else was faster."""
        try:
            return os.read(self.fd, BITE)
        except BlockingIOError:
            return None
        except OSError:  # the terminal is gone
            return b""


def may_read(fd: int) -> bool:
    """Whether commands may be typed: a pipe, or a terminal that this process is in front of."""
    try:
        return stat.S_ISFIFO(os.fstat(fd).st_mode) or (os.isatty(fd) and in_front(fd))
    except OSError:
        return False


def in_front(fd: int) -> bool:
    """Whether this process may use the terminal now; others may while it is in the background."""
    try:
        return os.tcgetpgrp(fd) == os.getpgrp()
    except OSError:  # not the terminal that controls this process: nobody else's then
        return os.isatty(fd)


def is_resumable() -> bool:
    """Whether a shell outside of this process group could resume it; the terminal suspends no others."""
    group, session, pid = os.getpgrp(), os.getsid(0), os.getppid()
    try:
        while os.getpgid(pid) == group:
            pid = int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
        return os.getsid(pid) == session
    except OSError:  # it is gone, or above everything that this process sees
        return False


def saved(fd: int) -> list[Any] | None:
    """The settings of a terminal, None of anything else."""
    try:
        return termios.tcgetattr(fd)
    except termios.error:
        return None


def restore(fd: int, settings: list[Any]) -> None:
    """Set a terminal at once, unless somebody else is in front of it by now."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTTOU})
    try:
        if in_front(fd):
            termios.tcsetattr(fd, termios.TCSANOW, settings)
    except termios.error:
        pass
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
