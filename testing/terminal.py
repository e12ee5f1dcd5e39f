"""A terminal for tests: somebody at its keyboard, what its screen shows, what is left of its program."""

from __future__ import annotations

import codecs
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
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..runtime.live.children import tied
from ..runtime.recording.reader import MAGIC

CTRL_C = "\x03"
PATIENCE_S = 90.0
ENVIRONMENT = "HAPTICD_TEST_FAMILY"
HAPTICD = (str(Path(sys.executable).with_name("hapticd")),)
_UNFINISHED = re.compile(r"\x1b(\[\d*)?$")
_DRAWN = re.compile(r"(?<=\x1b\[K)")
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
        """What a program writes."""
        at = 0
        for token in _TOKEN.finditer(text):
            self._print(text[at : token.start()])
            self._steer(token)
            at = token.end()
        self._print(text[at:])

    @property
    def text(self) -> str:
        """All that was ever shown, a line a row."""
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


@dataclass
class Ended:
    """A program that has ended: exit status (negative: killed by that signal), and what it wrote."""

    status: int
    said: str
    seconds: float


class Terminal:
    """A program on a pseudo-terminal that controls it, as a shell starts it in a window of its own.

    Attributes:
        process: the program.
        raw: what it wrote on the terminal.
        emulator: what the screen shows.
        before: settings of the terminal before the program changed them.
        slave: the program's end of the terminal.
    """

    def __init__(self, command: Sequence[str], folder: Path, **options: Any) -> None:
        """Options: columns, height, variables of the environment, stdout, stderr."""
        columns, height = options.get("columns", 80), options.get("height", 24)
        self._master, self.slave = pty.openpty()
        self.resize(columns, height)
        self.before = termios.tcgetattr(self.slave)
        self.emulator = Emulator(columns, height)
        self.raw = ""
        self._stood: set[str] = set()
        self._decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")
        self._unfinished = ""
        self._family = uuid.uuid4().hex
        self._begin = time.monotonic()
        tie = tied()

        def in_front() -> None:
            tie()
            for number in (signal.SIGHUP, signal.SIGINT):  # the tests may run under nohup, in the background
                signal.signal(number, signal.SIG_DFL)
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

        self.process = subprocess.Popen(
            command,
            stdin=self.slave,
            stdout=options.get("stdout", self.slave),
            stderr=options.get("stderr", self.slave),
            cwd=folder,
            env={**os.environ, "TERM": "xterm", ENVIRONMENT: self._family, **options.get("variables", {})},
            start_new_session=True,
            preexec_fn=in_front,
        )

    @property
    def pid(self) -> int:
        """Process id of the program."""
        return self.process.pid

    @property
    def modes(self) -> list[Any]:
        """Settings of the terminal."""
        return termios.tcgetattr(self.slave)

    @property
    def single_keys(self) -> bool:
        """Whether keys reach the program without Enter."""
        return not self.modes[3] & termios.ICANON

    def resize(self, columns: int, height: int) -> None:
        """The window gets another size."""
        fcntl.ioctl(self._master, termios.TIOCSWINSZ, struct.pack("4H", height, columns, 0, 0))

    def type(self, keys: str) -> None:
        """What a person types."""
        os.write(self._master, keys.encode())

    def look(self, seconds: float = 0.05) -> None:
        """Read what came, but wait no longer than this."""
        if self._master < 0:
            time.sleep(seconds)
        while self._master >= 0 and select.select([self._master], [], [], seconds)[0]:
            try:
                data = os.read(self._master, 1 << 16)
            except OSError:  # nobody is left at the other side
                self.close_window()
                return
            self._show(self._decoder.decode(data))
            seconds = 0.0

    def _show(self, text: str) -> None:
        self.raw += text
        text = self._unfinished + text
        cut = found.start() if (found := _UNFINISHED.search(text)) else len(text)
        self._unfinished = text[cut:]
        for piece in _DRAWN.split(text[:cut]):
            self.emulator.feed(piece)
            self._stood.update(self.staying)

    def wait_until(self, seconds: float) -> None:
        """Go on reading until this long after the start."""
        while (left := self._begin + seconds - time.monotonic()) > 0.0:
            self.look(left)

    def until(self, true: Callable[[], object], what: str) -> None:
        """Read until something is true; it fails where the program ends before, or after PATIENCE_S."""
        deadline = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < deadline, f"not within {PATIENCE_S} s: {what}\n{self.emulator.text}"
            assert self.process.poll() is None or true(), f"ended before: {what}\n{self.emulator.text}"
            self.look()

    def until_seen(self, text: str, times: int = 1) -> None:
        """Read until a text was shown, however its lines were broken."""
        self.until(lambda: " ".join(self.emulator.text.split()).count(text) >= times, text)

    def until_stays(self, text: str) -> None:
        """Read until a text stood on the lines at the bottom.

        Where the host is busy, many of them come at once.
        """
        self._stood = set(self.staying)
        self.until(lambda: any(text in row for row in self._stood), text)

    @property
    def staying(self) -> list[str]:
        """The rows from the live line on."""
        at = self.emulator._y
        return self.emulator.rows[at : at + 2]

    def end(self) -> Ended:
        """Wait for the program's end."""
        start = time.monotonic()
        while self.process.poll() is None:
            assert time.monotonic() < start + PATIENCE_S, self.emulator.text
            self.look(0.02)
        seconds = time.monotonic() - start
        self.look()
        return Ended(self.process.returncode, self.raw, seconds)

    def survivors(self) -> list[str]:
        """Processes of the family that are still there; they get some time to end."""
        deadline = time.monotonic() + PATIENCE_S / 6
        while (found := family(self._family)) and time.monotonic() < deadline:
            time.sleep(0.05)
        return found

    def child(self, module: str) -> int:
        """Process id of the daemon's plant or recorder."""
        return child(self.pid, module)

    def close_window(self) -> None:
        """Both ends that the window holds."""
        for fd in (self._master, self.slave):
            if fd >= 0:
                os.close(fd)
        self._master = self.slave = -1

    def dispose(self) -> None:
        """Leave nothing behind, however a test ended."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
            self.process.wait()
        self.close_window()


def child(parent: int, module: str) -> int:
    """Process id of the child of a process that runs a module."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                its_parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
                command = (entry / "cmdline").read_bytes().decode()
            except (OSError, IndexError):
                continue
            if its_parent == parent and module in command:
                return int(entry.name)
    raise AssertionError(f"no {module} process")


def family(mark: str) -> list[str]:
    """Command lines of living processes that were started, directly or not, with this mark."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            if f"{ENVIRONMENT}={mark}".encode() in (entry / "environ").read_bytes():
                found.append((entry / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:  # not ours, or gone
            continue
    return found


def complete(log: Path) -> bool:
    """Whether a recording has its end."""
    return log.read_bytes().endswith(MAGIC)
