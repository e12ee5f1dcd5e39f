"""The recorder process: takes records from the ring, writes the log, shows the live line, sums up.

    python -m hapticd.runtime.recorder CONFIG LOG RING_FD CONTROL_FD START_NS LIVE

The daemon tells it to finish with a byte on the control pipe; where the pipe closes without one, the daemon
is dead, and the recorder completes the log by itself. The summary goes to standard output as JSON.
"""

from __future__ import annotations

import fcntl
import os
import select
import sys
import time
from enum import Enum, auto

import msgspec
import numpy as np

from . import config
from .children import report_ready
from .errors import HapticdError
from .forensics import LateTick
from .interrupts import show
from .log import LogWriter
from .log_file import LogFile, cut_short
from .modes import Mode
from .record import layout
from .ring import Ring
from .session import Session, build, fingerprint
from .stages import Stage
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


class Recorder:
    """Consumes the ring of one session."""

    def __init__(self, session: Session, ring: Ring, log: LogWriter, dtype: np.dtype[np.void]) -> None:
        self._ring, self._log, self._dtype = ring, log, dtype
        self.summary = Summary(
            session.system.limits(session.config), session.config.loop.rate, session.memory.image.expected
        )

    def drain(self) -> list[str]:
        """Everything that is in the ring, while the disk takes it; returns the events."""
        events = []
        while not self._log.full and (data := self._ring.pop()) is not None:
            if data[:1] == TICK:
                fixed = np.frombuffer(data, self._dtype, 1, 1)[0]
                self._log.tick(int(fixed["tick"]), data[1:])
                self.summary.add(fixed)
            elif data[:1] == VITALS:
                self.summary.vitals = msgspec.json.decode(data[1:], type=Vitals)
            else:
                tick, rest = int.from_bytes(data[1:9], "little"), data[9:]
                text = self._note(data[:1], tick, rest)
                if text:
                    self._log.event(tick, text)
                    events.append(f"{tick / self.summary.rate:9.3f} s  {text}")
        self._log.flush()
        return events

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

    def live_line(self) -> str:
        """State, punctuality and cost of the session so far."""
        s, last = self.summary, self.summary.last
        if last is None:
            return "waiting for the first tick"
        late, compute = s.lateness.summary(), s.compute.summary()
        costs = sorted(((s.stages[stage].quantile(0.5), stage.name.lower()) for stage in Stage), reverse=True)
        dearest = ", ".join(f"{name} {us:.0f}" for us, name in costs[:3])
        touching = [
            extent.spec.name
            for extent, value in zip(s.extents, s.limits.values(last["state"]), strict=True)
            if value <= extent.spec.lower + 5e-3 or value >= extent.spec.upper - 5e-3
        ]
        force = float(np.linalg.norm(last["state"]["wrench"][:3]))
        return (
            f"{int(last['tick']) / s.rate:6.1f} s {Mode(int(last['mode'])).name:9}"
            f" late {late['p50']:.0f}/{late['p99']:.0f} us"
            f"  compute {compute['p50']:.0f}/{compute['p99']:.0f} us ({dearest})"
            f"  skipped {s.skipped}  force {force:4.0f} N"
            f"  {'at ' + ', '.join(touching) if touching else ''}"
        )


def main(arguments: list[str]) -> int:
    """Run until told to finish, or until the daemon is gone."""
    name, path, ring_fd, control_fd, start_ns, live = arguments
    session = build(config.load(name))
    machine, image = session.memory.machine, session.memory.image
    dtype = layout(machine.state, len(machine.axes), len(image.raw))
    with LogFile(path) as stream:
        log = LogWriter(stream, session.loaded, fingerprint(session), dtype, int(start_ns))
        recorder = Recorder(session, Ring.attach(int(ring_fd)), log, dtype)
        if not report_ready():
            os.unlink(path)  # nothing has begun
            return 0
        return _record(recorder, stream, path, int(control_fd), live == "1")


def _record(recorder: Recorder, stream: LogFile, path: str, control: int, live: bool) -> int:
    """From the first record to the complete log; the exit status."""
    refused: OSError | None = None
    end: End | None = None
    try:
        end = _serve(recorder, stream, control, live)
        recorder.finish()
    except OSError as error:
        refused = error
    report = recorder.report()
    failure = refused or stream.full
    if failure:
        seconds = report.ticks / report.rate_hz
        _show(f"hapticd: {cut_short(path, seconds, refused is None, failure)}\n", live)
    if end is End.SILENT and not refused:
        _show(f"hapticd: the daemon died; its log is complete: {path}\n", live)
    else:
        _say_last(as_json(report).encode())
    return TORN if refused else CUT_SHORT if failure else 0


def _say_last(words: bytes) -> None:
    """The summary for the daemon, whether it reads it now, later or never."""
    try:
        fcntl.fcntl(1, fcntl.F_SETPIPE_SZ, LONGEST_SUMMARY)
        os.write(1, words)
    except OSError:
        return


def _serve(recorder: Recorder, stream: LogFile, control: int, live: bool) -> End:
    """Drain until the control pipe says or shows the end, or the disk takes no more; which of them."""
    shown = 0.0
    while True:
        readable, _, _ = select.select([control], [], [], POLL_S)
        said = os.read(control, 1) if readable else b""
        for event in recorder.drain():
            _show(f"{event}\n", live)
        now = time.monotonic()
        if live and now - shown >= LIVE_S:
            shown = now
            _show(recorder.live_line(), live)
        if readable or stream.full:
            if live:
                _show("", live)
            return End.FULL if stream.full else End.TOLD if said == FINISH else End.SILENT


def _show(text: str, live: bool) -> None:
    show(f"\r\x1b[K{text}" if live else text)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except HapticdError as error:
        print(f"hapticd recorder: {error}", file=sys.stderr)
        sys.exit(error.exit_status)
