"""A terminal for tests: a pseudo-terminal with somebody at its keyboard, and what its screen shows."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

PATIENCE_S = 90.0
_TOKEN = re.compile(r"\x1b\[(\d*)([A-Za-z])|([\r\n\b\x07])|(\x1b.?)")


class Emulator:
    """As much of a terminal as the program may use; anything else is an error.

    Attributes:
        history: rows that have scrolled off at the top.
        rows: what is on the screen.
        wrapped: how often a row was full and the text went on in the next one.
    """

    def __init__(self, columns: int, height: int) -> None:
        self.columns, self.height = columns, height
        self.history: list[str] = []
        self.rows = [""] * height
        self.wrapped = 0
        self._x = self._y = 0

    def feed(self, text: str) -> None:
        at = 0
        for token in _TOKEN.finditer(text):
            self._print(text[at : token.start()])
            self._steer(token)
            at = token.end()
        self._print(text[at:])

    @property
    def text(self) -> str:
        return "\n".join([*self.history, *self.rows])

    def _print(self, text: str) -> None:
        for character in text:
            assert character.isprintable(), repr(character)
            if self._x == self.columns:
                self.wrapped += 1
                self._x = 0
                self._down()
            row = self.rows[self._y].ljust(self._x)
            self.rows[self._y] = row[: self._x] + character + row[self._x + 1 :]
            self._x += 1

    def _steer(self, token: re.Match[str]) -> None:
        count, verb, control, unknown = token.groups()
        assert unknown is None, repr(unknown)
        if control == "\r":
            self._x = 0
        elif control == "\n":
            self._down()
        elif verb == "A":
            self._y = max(0, self._y - int(count or 1))
        elif verb in ("J", "K"):
            assert not count
            self.rows[self._y] = self.rows[self._y][: self._x]
            if verb == "J":
                self.rows[self._y + 1 :] = [""] * (self.height - self._y - 1)
        else:
            assert control, f"CSI {count}{verb}"

    def _down(self) -> None:
        self._y += 1
        if self._y == self.height:
            self.history.append(self.rows.pop(0))
            self.rows.append("")
            self._y -= 1


class Terminal:
    """A program on a pseudo-terminal that controls it, as in a window of its own."""

    def __init__(self, folder: Path, *command: str, **options: Any) -> None:
        """Options: columns, height, variables of the environment, stdout, stderr."""
        columns, height = options.get("columns", 80), options.get("height", 24)
        self.master, slave = pty.openpty()
        self.resize(columns, height)
        self.before = termios.tcgetattr(slave)
        self.emulator = Emulator(columns, height)
        self.raw = ""
        self.closed = False
        self.process = subprocess.Popen(
            [sys.executable, "-m", "hapticd.runtime", *command],
            stdin=slave,
            stdout=options.get("stdout", slave),
            stderr=options.get("stderr", slave),
            cwd=folder,
            env={**os.environ, "TERM": "xterm", **options.get("variables", {})},
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        self.slave = slave

    @property
    def modes(self) -> list[Any]:
        """Settings of the terminal."""
        return termios.tcgetattr(self.slave)

    @property
    def single_keys(self) -> bool:
        return not self.modes[3] & termios.ICANON

    def resize(self, columns: int, height: int) -> None:
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack("4H", height, columns, 0, 0))

    def type(self, keys: str) -> None:
        os.write(self.master, keys.encode())

    def look(self, seconds: float = 0.05) -> None:
        """Read what came, but wait no longer than this."""
        while not self.closed and select.select([self.master], [], [], seconds)[0]:
            try:
                text = os.read(self.master, 65536).decode(errors="replace")
            except OSError:
                self.closed = True
                return
            self.raw += text
            self.emulator.feed(text)
            seconds = 0.0

    def until(self, true: Callable[[], object], what: str) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < deadline, f"not within {PATIENCE_S} s: {what}\n{self.emulator.text}"
            assert self.process.poll() is None or true(), f"ended before: {what}\n{self.emulator.text}"
            self.look()

    def until_seen(self, text: str, times: int = 1) -> None:
        self.until(lambda: " ".join(self.emulator.text.split()).count(text) >= times, text)

    def until_stays(self, text: str) -> None:
        """On the lines at the bottom."""
        self.until(lambda: any(text in row for row in self.staying), text)

    @property
    def staying(self) -> list[str]:
        """The rows from the live line on."""
        at = self.emulator._y
        return self.emulator.rows[at : at + 2]

    def end(self) -> int:
        deadline = time.monotonic() + PATIENCE_S
        while self.process.poll() is None:
            assert time.monotonic() < deadline, self.emulator.text
            self.look()
        self.look()
        return self.process.returncode

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
            self.process.wait()
        for fd in (self.master, self.slave):
            try:
                os.close(fd)
            except OSError:
                pass
