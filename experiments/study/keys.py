"""Answers by single keys of a terminal, or by characters through a pipe."""

from __future__ import annotations

import os
import select
import termios
import tty
from collections.abc import Callable, Sequence

from ...runtime.live.interrupts import Interrupted, heard

LOOK_S = 0.05
"""How long a signal waits to be noticed."""


class Keys:
    """Keys of a file descriptor; what was pressed before a question does not answer it."""

    def __init__(self, fd: int) -> None:
        self._fd, self._terminal = fd, os.isatty(fd)

    def ask(self, keys: Sequence[str], wrong: Callable[[str], None]) -> str:
        """Wait for one of some keys; ``wrong`` is told of others.

        Raises:
            Interrupted: a signal asked for the end.
            EOFError: nobody will answer any more.
        """
        before = termios.tcgetattr(self._fd) if self._terminal else None
        signals: list[int] = []
        try:
            if before is not None:
                tty.setcbreak(self._fd, termios.TCSAFLUSH)
            with heard(signals.append):
                while True:
                    if signals:
                        raise Interrupted(signals[0])
                    if not select.select([self._fd], [], [], LOOK_S)[0]:
                        continue
                    key = os.read(self._fd, 1).decode("latin-1")
                    if not key or key == "\x04":
                        raise EOFError
                    if key in keys:
                        return key
                    if not key.isspace():
                        wrong(key)
        finally:
            if before is not None:
                termios.tcsetattr(self._fd, termios.TCSADRAIN, before)
