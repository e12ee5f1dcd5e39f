"""A recorded session in lockstep: the plant in-process, virtual time, as fast as it goes."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter

from ..configuration.config import Loaded
from ..configuration.session import build, fingerprint
from ..core.modes import Command, Mode
from ..recording.log import LogWriter
from ..recording.log_file import LogFile, cut_short
from ..recording.record import NO_TIMING, RecordWriter
from ..recording.summary import Summary, as_json
from .interrupts import heard, show
from .lockstep import Lockstep, unswept
from .outcome import END_LIMIT_S, Ending, Outcome, called_off, outcome
from .screen import CLEAR_BELOW

DEFAULT_S = 30.0


def run(loaded: Loaded, log: Path, duration: float | None, live: bool) -> Outcome:
    """Run for a duration [s] of virtual time, bring the machine to rest, write the log and sum up.

    Without a duration it is that of the configuration.
    """
    signals: list[int] = []
    with heard(signals.append):
        session = build(loaded)
        lockstep = Lockstep(session)
        if signals:
            return called_off(signals[0])
        seconds = duration or loaded.config.loop.duration or DEFAULT_S
        with unswept():
            return _run(lockstep, loaded, log, seconds, live, signals)


def _run(
    lockstep: Lockstep, loaded: Loaded, log: Path, duration: float, live: bool, signals: list[int]
) -> Outcome:
    """A signal ends the session, a second one does not wait for the machine to come to rest."""
    session, ending = lockstep.session, Ending()
    cycle, rate = session.cycle, loaded.config.loop.rate
    ticks = round(duration * rate)
    writer = RecordWriter(cycle)
    summary = Summary.of(session)
    clear = f"\r{CLEAR_BELOW}" if live else ""
    begin = perf_counter()
    torn: OSError | None = None
    stream = LogFile(log)
    try:
        # tick 0 at time 0: the same session gives the same file
        recording = LogWriter(stream, loaded, fingerprint(session), writer.fixed.dtype, 0)

        def step(commands: Command = Command.NONE) -> None:
            lockstep.tick(commands)
            tick = lockstep.inputs.tick
            ending.moved |= cycle.mode.powered
            recording.tick(tick, writer.write(lockstep.inputs, NO_TIMING))
            summary.add(writer.fixed[0])
            for event in lockstep.outputs.events:
                recording.event(tick, event)
                show(f"{clear}{tick / rate:9.3f} s  {event}\n")
            if live and tick % 500 == 0:
                show(f"{clear}{tick / rate:6.1f} s {cycle.mode.name}")

        while lockstep.inputs.tick + 1 < ticks and not (signals or stream.full or cycle.mode is Mode.FAILED):
            step()
        step(Command.END)
        last = lockstep.inputs.tick + END_LIMIT_S * rate
        while not cycle.drives.secured and lockstep.inputs.tick < last and len(signals) < 2:
            step()
        show(clear)
        recording.finish(as_json(summary.report(0)))
    except OSError as error:
        torn = error
    finally:
        stream.close()
    report = summary.report(0)
    if torn or stream.full:
        ending.failed = cut_short(log, report.ticks / rate, torn is None, torn or stream.full)
    ending.signals = tuple(signals)
    speed_x = round((lockstep.inputs.tick + 1) / rate / (perf_counter() - begin), 2)
    return outcome(cycle, report, ending, speed_x)
