"""A recorded session in lockstep: the plant in-process, virtual time, as fast as it goes."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter

from .config import Loaded
from .interrupts import heard, show
from .lockstep import Lockstep
from .log import LogWriter
from .log_file import LogFile, cut_short
from .modes import Command, Mode
from .outcome import END_LIMIT_S, Ending, Outcome, called_off, outcome
from .record import NO_TIMING, RecordWriter
from .screen import CLEAR_BELOW
from .session import build, fingerprint
from .summary import Summary, as_json

DEFAULT_S = 30.0


def run(loaded: Loaded, log: Path, duration: float | None, live: bool) -> Outcome:
    """Run for a duration [s] of virtual time, bring the machine to rest, write the log and sum up."""
    signals: list[int] = []
    with heard(signals.append):
        session = build(loaded)
        lockstep = Lockstep(session)
        if signals:
            return called_off(signals[0])
        return _run(lockstep, loaded, log, duration or DEFAULT_S, live, signals)


def _run(
    lockstep: Lockstep, loaded: Loaded, log: Path, duration: float, live: bool, signals: list[int]
) -> Outcome:
    """A signal ends the session, a second one does not wait for the machine to come to rest."""
    session, ending = lockstep.session, Ending()
    memory, rate = session.memory, loaded.config.loop.rate
    ticks = round(duration * rate)
    writer = RecordWriter(memory)
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
            ending.moved |= memory.mode.powered
            recording.tick(tick, writer.write(lockstep.inputs, lockstep.outputs, NO_TIMING))
            summary.add(writer.fixed[0])
            for text in lockstep.outputs.events:
                recording.event(tick, text)
                show(f"{clear}{tick / rate:9.3f} s  {text}\n")
            if live and tick % 500 == 0:
                show(f"{clear}{tick / rate:6.1f} s {memory.mode.name}")

        while lockstep.inputs.tick + 1 < ticks and not (signals or stream.full or memory.mode is Mode.FAILED):
            step()
        step(Command.END)
        last = lockstep.inputs.tick + END_LIMIT_S * rate
        while not memory.secured and lockstep.inputs.tick < last and len(signals) < 2:
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
    return outcome(memory, report, ending, speed_x)
