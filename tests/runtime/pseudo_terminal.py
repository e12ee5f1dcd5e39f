"""A program in front of a pseudo-terminal of its own, and what is left of it afterwards."""

from __future__ import annotations

import os
import pty
import select
import signal
import sys
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hapticd.runtime.children import tied
from hapticd.runtime.recording import MAGIC

CTRL_C = "\x03"
PATIENCE_S = 60.0
ENVIRONMENT = "HAPTICD_TEST_FAMILY"
HAPTICD = (str(Path(sys.executable).with_name("hapticd")),)


@dataclass
class Ended:
    """A program that has ended: exit status (negative: killed by that signal), and what it wrote."""

    status: int
    said: str
    seconds: float

    @property
    def lines(self) -> list[str]:
        """What hapticd itself said."""
        texts = self.said.replace("\r", "\n").split("\n")
        return [text[text.index("hapticd: ") :] for text in texts if "hapticd: " in text]


class Terminal:
    """Starts a program as a shell does: a session of its own, the terminal in front of it."""

    def __init__(self, command: Sequence[str], folder: Path, errors: Path | None = None) -> None:
        """Standard error goes to a file where one is named."""
        self.family = uuid.uuid4().hex
        self._begin = time.monotonic()
        self._said = b""
        tie = tied()
        if errors:
            errors.touch()
        self.pid, self._fd = pty.fork()
        if self.pid == 0:
            try:
                tie()
                os.chdir(folder)
                if errors:
                    os.dup2(os.open(errors, os.O_WRONLY), 2)
                os.execve(command[0], command, {**os.environ, "TERM": "xterm", ENVIRONMENT: self.family})
            finally:
                os._exit(127)

    def wait_until(self, seconds: float) -> None:
        """Go on reading until this long after the start."""
        while (left := self._begin + seconds - time.monotonic()) > 0.0 and self._fd >= 0:
            self._read(left)

    def wait_for(self, text: str) -> None:
        """Go on reading until it was said."""
        deadline = time.monotonic() + PATIENCE_S
        while text not in self._said.decode(errors="replace"):
            assert time.monotonic() < deadline, f"no '{text}' in {self._said.decode(errors='replace')}"
            self._read(0.1)

    def type(self, keys: str) -> None:
        """What a person types."""
        os.write(self._fd, keys.encode())

    def close(self) -> None:
        """Close the window."""
        os.close(self._fd)
        self._fd = -1

    def end(self) -> Ended:
        """Wait for the program's end."""
        start = time.monotonic()
        while not (done := os.waitpid(self.pid, os.WNOHANG))[0]:
            if time.monotonic() > start + PATIENCE_S:
                os.kill(self.pid, signal.SIGKILL)
            self._read(0.02)
        seconds = time.monotonic() - start
        while self._fd >= 0 and self._read(0.1):
            pass
        if self._fd >= 0:
            self.close()
        return Ended(os.waitstatus_to_exitcode(done[1]), self._said.decode(errors="replace"), seconds)

    def survivors(self) -> list[str]:
        """Processes of the family that are still there; they get some time to end."""
        deadline = time.monotonic() + PATIENCE_S / 4
        while (found := family(self.family)) and time.monotonic() < deadline:
            time.sleep(0.05)
        return found

    def _read(self, seconds: float) -> bool:
        if self._fd < 0:
            time.sleep(seconds)
            return False
        if not select.select([self._fd], [], [], seconds)[0]:
            return False
        try:
            data = os.read(self._fd, 1 << 16)
        except OSError:  # nobody is left at the other side
            self.close()
            return False
        self._said += data
        return bool(data)


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
