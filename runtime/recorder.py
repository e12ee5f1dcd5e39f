"""The recorder process: takes records from the ring, writes the log, shows the live line, sums up.

    python -m hapticd.runtime.recorder CONFIG LOG RING_FD CONTROL_FD START_NS SHOWN DURATION

SHOWN is a name of ``Shown``, DURATION in seconds or 0. The daemon tells it to finish with a byte on the
control pipe; where the pipe closes without one, the daemon is dead, and the recorder completes the log and
gives the terminal back by itself. The summary goes to standard output as JSON. The log never waits for the
terminal.
"""

from __future__ import annotations

import fcntl
import os
import select
import sys
import time
from collections.abc import Callable
from enum import Enum, auto
from functools import partial

import msgspec
import numpy as np

from . import config
from .children import ignore_job_control, report_ready
from .errors import HapticdError
from .forensics import LateTick
from .keyboard import in_front, restore, saved
from .live_line import LiveLine
from .log import LogWriter
from .log_file import LogFile, cut_short
from .orders import key_line, possible
from .outlet import Outlet
from .record import layout
from .ring import Ring
from .screen import Screen, terminal_size
from .session import Session, build, fingerprint
from .summary import Report, Summary, as_json
from .vitals import Vitals
from .watch import Overstay

POLL_S = 0.02
LIVE_S = 0.2
FINISH = b"q"
TICK, EVENT, LATE, OVERSTAY, VITALS = b"T", b"E", b"L", b"O", b"V"
"""First byte of a record in the ring."""
CUT_SHORT, TORN = 4, 5
"""Exit status where the disk did not take the whole log: it is complete as far as it goes, or not at all."""
LONGEST_SUMMARY = 1 << 20


class End(Enum):
    """Why no more is recorded."""

    TOLD = auto()
    SILENT = auto()
    """The daemon is gone."""
    FULL = auto()
    """The disk takes no more."""


SAY, HIDE, SHOW = b"S", b"H", b"W"
"""The same of what concerns the screen only: a text, and whether lines stay on it."""
STDERR = 2


class Shown(Enum):
    """What a person sees: messages only, the live line too, or besides that the keys that can be pressed."""

    PLAIN = "plain"
    LIVE = "live"
    KEYS = "keys"


class Recorder:
    """Consumes the ring of one session.

    Attributes:
        screen: what a person sees.
        hidden: whether the screen belongs to somebody else for now.
        summary: of the session so far.
    """

    def __init__(
        self, session: Session, ring: Ring, log: LogWriter, dtype: np.dtype[np.void], screen: Screen
    ) -> None:
        self._ring, self._log, self._dtype, self.screen = ring, log, dtype, screen
        self.hidden = False
        self.summary = Summary.of(session)

    def drain(self) -> None:
        """Everything that is in the ring, while the disk takes it."""
        while not self._log.full and (data := self._ring.pop()) is not None:
            if data[:1] == TICK:
                fixed = np.frombuffer(data, self._dtype, 1, 1)[0]
                self._log.tick(int(fixed["tick"]), data[1:])
                self.summary.add(fixed)
            elif data[:1] == SAY:
                self.screen.message(data[1:].decode())
            elif data[:1] in (HIDE, SHOW):
                self.hidden = data[:1] == HIDE
                self.screen.leave()
            elif data[:1] == VITALS:
                self.summary.vitals = msgspec.json.decode(data[1:], type=Vitals)
            else:
                tick, rest = int.from_bytes(data[1:9], "little"), data[9:]
                text = self._note(data[:1], tick, rest)
                if text:
                    self._log.event(tick, text)
                    self.screen.message(f"{tick / self.summary.rate:9.3f} s  {text}")
        self._log.flush()

    def report(self) -> Report:
        """The summary so far."""
        return self.summary.report(self._ring.dropped)

    def finish(self) -> None:
        """Complete the log."""
        self._log.finish(as_json(self.report()))

    def _note(self, kind: bytes, tick: int, rest: bytes) -> str:
        """Take what happened at a tick; the sentence for people, empty where none is due."""
        if kind == EVENT:
            return rest.decode()
        if kind == LATE:
            self._log.late(tick, rest)
            self.summary.add_late(msgspec.json.decode(rest, type=LateTick))
            return ""
        overstay = msgspec.json.decode(rest, type=Overstay)
        if not self.summary.add_overstay(overstay):
            return ""
        took, budget = f"{overstay.us:.0f} us", f"{overstay.budget_us:.0f} us"
        return f"warning: {overstay.where} took {took}; between ticks it may take {budget}"


def main(arguments: list[str]) -> int:
    """Run until told to finish, or until the daemon is gone."""
    name, path, ring_fd, control_fd, start_ns, shown, duration = arguments
    ignore_job_control()
    before = saved(STDERR)
    session = build(config.load(name))
    machine, image = session.memory.machine, session.memory.image
    dtype = layout(machine.state, len(machine.axes), len(image.raw))
    view = Shown[shown]
    screen = Screen(Outlet(STDERR), view is not Shown.PLAIN, partial(terminal_size, STDERR))
    with LogFile(path) as stream:
        log = LogWriter(stream, session.loaded, fingerprint(session), dtype, int(start_ns))
        recorder = Recorder(session, Ring.attach(int(ring_fd)), log, dtype, screen)
        keys = possible(session.config) if view is Shown.KEYS else ()
        line = LiveLine(session, recorder.summary, keys, float(duration))
        if not report_ready():
            os.unlink(path)  # nothing has begun
            return 0
        serve = partial(_serve, recorder, stream, int(control_fd), line, key_line(keys))
        end, status = _record(recorder, stream, path, serve)
    if before and end is End.SILENT:
        restore(STDERR, before)
    screen.close()
    return status


def _record(
    recorder: Recorder, stream: LogFile, path: str, serve: Callable[[], End]
) -> tuple[End | None, int]:
    """From the first record to the complete log: why it ended, and the exit status."""
    refused: OSError | None = None
    end: End | None = None
    try:
        end = serve()
        recorder.finish()
    except OSError as error:
        refused = error
    report = recorder.report()
    failure = refused or stream.full
    if failure:
        seconds = report.ticks / report.rate_hz
        recorder.screen.message(f"hapticd: {cut_short(path, seconds, refused is None, failure)}")
    if end is End.SILENT and not refused:
        recorder.screen.message(f"hapticd: the daemon died; its log is complete: {path}")
    else:
        _say_last(as_json(report).encode())
    return end, TORN if refused else CUT_SHORT if failure else 0


def _say_last(words: bytes) -> None:
    """The summary for the daemon, whether it reads it now, later or never."""
    try:
        fcntl.fcntl(1, fcntl.F_SETPIPE_SZ, LONGEST_SUMMARY)
        os.write(1, words)
    except OSError:
        return


def _serve(recorder: Recorder, stream: LogFile, control: int, line: LiveLine, keys: list[str]) -> End:
    """Drain until the control pipe says or shows the end, or the disk takes no more; which of them."""
    screen, shown = recorder.screen, 0.0
    while True:
        readable, _, _ = select.select([control], [], [], POLL_S)
        said = os.read(control, 1) if readable else b""
        recorder.drain()
        if readable or stream.full:
            screen.leave()
            return End.FULL if stream.full else End.TOLD if said == FINISH else End.SILENT
        screen.flush()
        now = time.monotonic()
        if now - shown < LIVE_S:
            continue
        shown = now
        if recorder.hidden or not in_front(STDERR):
            screen.forget()
        else:
            screen.stay([line.words(), keys] if keys else [line.words()])


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except HapticdError as error:
        print(f"hapticd recorder: {error}", file=sys.stderr)
        sys.exit(error.exit_status)
