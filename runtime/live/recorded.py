"""A session in lockstep that is written into a log and summed up, tick by tick."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..configuration.config import Loaded
from ..configuration.session import fingerprint
from ..core.events import Event
from ..core.modes import Command
from ..recording.log import LogWriter
from ..recording.log_file import LogFile, cut_short
from ..recording.record import NO_TIMING, RecordWriter
from ..recording.summary import Report, Summary, as_json
from .lockstep import Lockstep
from .outcome import END_LIMIT_S, Ending, Outcome, outcome


class Recorded:
    """A lockstep session and its log.

    Attributes:
        lockstep: the session and its plant.
        stream: the log.
        ending: what its end has to do with besides the machine.
    """

    def __init__(
        self, lockstep: Lockstep, loaded: Loaded, log: Path, say: Callable[[float, Event], None]
    ) -> None:
        """Begin the log; ``say`` is told what people should know, with its time [s].

        Raises:
            OSError: the log cannot be written.
        """
        self.lockstep, self._log, self._say = lockstep, log, say
        self._cycle = cycle = lockstep.session.cycle
        self._rate = loaded.config.loop.rate
        self._writer, self.summary = RecordWriter(cycle), Summary.of(lockstep.session)
        self.ending = Ending()
        self.stream = LogFile(log)
        # tick 0 at time 0: the same session gives the same file
        dtype = self._writer.fixed.dtype
        self._recording = LogWriter(self.stream, loaded, fingerprint(lockstep.session), dtype, 0)
        self._last: float | None = None

    @property
    def ticks(self) -> int:
        """So far."""
        return self.lockstep.inputs.tick + 1

    def step(self, commands: Command = Command.NONE) -> None:
        """One tick."""
        lockstep = self.lockstep
        lockstep.tick(commands)
        tick = lockstep.inputs.tick
        self.ending.moved |= self._cycle.mode.powered
        self._recording.tick(tick, self._writer.write(lockstep.inputs, NO_TIMING))
        self.summary.add(self._writer.fixed[0])
        for event in lockstep.outputs.events:
            self._recording.event(tick, event)
            self._say(tick / self._rate, event)

    def end(self) -> None:
        """One tick, in which the session is told to end."""
        self.step(Command.END)
        self._last = self.lockstep.inputs.tick + END_LIMIT_S * self._rate

    @property
    def ended(self) -> bool:
        """Whether it was told to end, and no drive has power any more, or it takes too long."""
        return self._last is not None and (
            self._cycle.drives.secured or self.lockstep.inputs.tick >= self._last
        )

    def finish(self) -> None:
        """Complete the log."""
        self._recording.finish(as_json(self.summary.report(0)))

    def close(self) -> None:
        """Close the log, complete or not."""
        self.stream.close()

    def outcome(self, torn: OSError | None, speed_x: float) -> Outcome:
        """What became of it, and of its log where writing was torn; times as fast as real time."""
        report: Report = self.summary.report(0)
        if torn or self.stream.full:
            seconds = report.ticks / self._rate
            self.ending.failed = cut_short(self._log, seconds, torn is None, torn or self.stream.full)
        return outcome(self._cycle, report, self.ending, speed_x)
