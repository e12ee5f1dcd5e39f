"""Answers by single keys or by lines of a terminal, or by characters through a pipe."""

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

    def ask(self, answers: Sequence[str], wrong: Callable[[str], None]) -> str:
        """Wait for one of some answers; ``wrong`` is told of others.

        Single keys answer as they are pressed; where an answer is longer, Enter ends it.

        Raises:
            Interrupted: a signal asked for the end.
            EOFError: nobody will answer any more.
        """
        before = termios.tcgetattr(self._fd) if self._terminal else None
        single = all(len(answer) == 1 for answer in answers)
        signals: list[int] = []
        try:
            if before is not None and single:
                tty.setcbreak(self._fd, termios.TCSAFLUSH)
            elif before is not None:  # the terminal shows what is typed, and lets it be mended
                termios.tcflush(self._fd, termios.TCIFLUSH)
            with heard(signals.append):
                while True:
                    given = self._key(signals) if single else self._line(signals)
                    if given in answers:
                        return given
                    if not given.isspace():
                        wrong(given)
        finally:
            if before is not None:
                termios.tcsetattr(self._fd, termios.TCSADRAIN, before)

    def _line(self, signals: list[int]) -> str:
        """What comes before the next Enter."""
        line = ""
        while (key := self._key(signals)) != "\n":
            line += key
        return line.strip() or "\n"

    def _key(self, signals: list[int]) -> str:
        while not select.select([self._fd], [], [], LOOK_S)[0]:
            if signals:
                raise Interrupted(signals[0])
        if signals:
            raise Interrupted(signals[0])
        key = os.read(self._fd, 1).decode("latin-1")
        if not key or key == "\x04":
            raise EOFError
        return key
