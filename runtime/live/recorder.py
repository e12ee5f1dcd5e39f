"""The recorder process: takes records from the ring, writes the log, shows the live line, sums up.

    python -m hapticd.runtime.live.recorder CONFIG LOG RING_FD CONTROL_FD START_NS SHOWN DURATION

SHOWN is a name of ``Shown``, DURATION in seconds or 0. What it takes it also publishes, in frames that
viewers may read or not: it never learns of them. The daemon tells it to finish with a byte on the
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

from ..configuration import config
from ..configuration.session import Session, build, fingerprint
from ..core.events import Event, EventKind
from ..errors import HapticdError
from ..recording.frames import FrameMaker, Stored
from ..recording.log import LogWriter
from ..recording.log_file import LogFile, cut_short
from ..recording.published import SUFFIX, About, Publisher, SessionError, run_folder, sweep
from ..recording.record import layout
from ..recording.ring import Ring
from ..recording.summary import Report, Summary, as_json
from ..timing.forensics import LateTick
from ..timing.vitals import Vitals
from ..timing.watch import Overstay
from .children import ignore_job_control, report_ready
from .keyboard import in_front, restore, saved
from .live_line import LiveLine
from .orders import key_line, possible, viewed
from .outlet import Outlet
from .screen import Screen, terminal_size

POLL_S = 0.02
LIVE_S = 0.2
HISTOGRAM_FRAMES = 25
"""Frames between two that carry histograms."""
FINISH = b"q"
TICK, EVENT, LATE, OVERSTAY, VITALS, LED = b"T", b"E", b"L", b"O", b"V", b"P"
"""First byte of a record in the ring; LED: a person took over from the script, and whether without an end."""
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
        endless: whether a person took over a session whose end nobody had asked for.
        summary: of the session so far.
    """

    def __init__(
        self,
        session: Session,
        ring: Ring,
        log: LogWriter,
        dtype: np.dtype[np.void],
        screen: Screen,
        publisher: Publisher | None = None,
        stream: LogFile | None = None,
    ) -> None:
        self._stream, self._free = stream, 0
        self._ring, self._log, self._dtype, self.screen = ring, log, dtype, screen
        self.hidden = self.endless = False
        self.summary = Summary.of(session)
        self._frames, self._publisher = FrameMaker(session), publisher

    def drain(self) -> None:
        """Everything that is in the ring, while the disk takes it."""
        while not self._log.full and (data := self._ring.pop()) is not None:
            if data[:1] == TICK:
                fixed = np.frombuffer(data, self._dtype, 1, 1)[0]
                self._log.tick(int(fixed["tick"]), data[1:])
                self.summary.add(fixed)
                if self._publisher:
                    self._frames.tick(fixed)
            elif data[:1] == SAY:
                self.screen.message(data[1:].decode())
            elif data[:1] in (HIDE, SHOW):
                self.hidden = data[:1] == HIDE
                self.screen.leave()
            elif data[:1] == LED:
                self.summary.led, self.endless = True, bool(data[1])
            elif data[:1] == VITALS:
                self.summary.vitals = msgspec.json.decode(data[1:], type=Vitals)
            else:
                tick, rest = int.from_bytes(data[1:9], "little"), data[9:]
                recorded, shown = self._note(data[:1], tick, rest)
                if recorded:
                    self._log.event(tick, recorded)
                if recorded and self._publisher:
                    self._frames.event(tick, recorded.severity, str(recorded))
                if shown:
                    self.screen.message(f"{tick / self.summary.rate:9.3f} s  {shown}")
        self._log.flush()
        if self._publisher:
            self._publish(self._publisher)

    def report(self) -> Report:
        """The summary so far."""
        return self.summary.report(self._ring.dropped)

    def finish(self) -> None:
        """Complete the log."""
        self._log.finish(as_json(self.report()))

    def _publish(self, publisher: Publisher) -> None:
        summary = self.summary
        counts = {
            "ticks skipped": summary.skipped,
            "frames discarded": summary.discarded,
            "answers missing": summary.missing,
            "commands put right": summary.put_right,
            "ticks late": summary.late,
            "records lost": self._ring.dropped,
            "frames left out": publisher.unfit,
        }
        due = publisher.count % HISTOGRAM_FRAMES == 0
        frame = self._frames.take(counts, (summary.lateness, summary.compute) if due else None)
        if frame:
            frame.stored = self._stored(due)
            publisher.publish(frame)

    def _stored(self, look: bool) -> Stored | None:
        """How the recording does; the disk is looked at now and then."""
        stream, ring = self._stream, self._ring
        if stream is None:
            return None
        if look or not self._free:
            disk = os.fstatvfs(stream.fileno())
            self._free = disk.f_bavail * disk.f_frsize
        return Stored(stream.tell(), ring.unread, ring.room, self._free)

    def _note(self, kind: bytes, tick: int, rest: bytes) -> tuple[Event | None, Event | None]:
        """Take what happened at a tick; what the log and the screen say of it, None where nothing is due.

        People hear of a callback that overstays where it made a tick late.
        """
        if kind == EVENT:
            event = msgspec.json.decode(rest, type=Event)
            return event, event
        if kind == LATE:
            self._log.late(tick, rest)
            late = msgspec.json.decode(rest, type=LateTick)
            first = late.cause not in self.summary.blamed
            self.summary.add_late(late)
            us = dict(late.callbacks).get(late.cause)
            return None, EventKind.LATE_TICK(cause=late.cause, us=us) if us and first else None
        overstay = msgspec.json.decode(rest, type=Overstay)
        if not self.summary.add_overstay(overstay):
            return None, None
        where, us, budget_us = overstay.where, overstay.us, overstay.budget_us
        return EventKind.OVERSTAYED(where=where, us=us, budget_us=budget_us), None


def main(arguments: list[str]) -> int:
    """Run until told to finish, or until the daemon is gone."""
    name, path, ring_fd, control_fd, start_ns, shown, duration = arguments
    ignore_job_control()
    before = saved(STDERR)
    session = build(config.load(name), runs=False)
    machine, image = session.cycle.machine, session.cycle.image
    dtype = layout(machine.state, len(machine.axes), len(image.raw))
    view = Shown[shown]
    screen = Screen(Outlet(STDERR), view is not Shown.PLAIN, partial(terminal_size, STDERR))
    with LogFile(path) as stream:
        log = LogWriter(stream, session.loaded, fingerprint(session), dtype, int(start_ns))
        publisher = _publisher(session, path, screen)
        recorder = Recorder(session, Ring.attach(int(ring_fd)), log, dtype, screen, publisher, stream)
        keys = possible(session.config) if view is Shown.KEYS else ()
        line = LiveLine(session, recorder.summary, keys, float(duration))
        if not report_ready():
            os.unlink(path)  # nothing has begun
            if publisher:
                publisher.close()
            return 0
        serve = partial(_serve, recorder, stream, int(control_fd), line, key_line(keys))
        end, status = _record(recorder, stream, path, serve)
    if publisher:
        publisher.close()
    if before and end is End.SILENT:
        restore(STDERR, before)
    screen.close()
    return status


def _publisher(session: Session, log: str, screen: Screen) -> Publisher | None:
    """Where viewers look; a session that cannot be looked at runs all the same."""
    words = [order.word for order in viewed(session.config)]
    loaded = session.loaded
    texts = (loaded.text, loaded.source, loaded.model_text, loaded.model_source)
    rate = float(session.config.loop.rate)
    about = About(os.path.abspath(log), loaded.name, *texts, rate, os.getppid(), words)
    try:
        sweep()
        return Publisher(run_folder() / f"{about.pid}{SUFFIX}", about)
    except (OSError, SessionError) as error:
        screen.message(f"hapticd: nobody can watch this session: {error}")
        return None


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
            words = line.words(recorder.endless)
            screen.stay([words, keys] if keys else [words])


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except HapticdError as error:
        print(f"hapticd recorder: {error}", file=sys.stderr)
        sys.exit(error.exit_status)
