"""A recorded session in lockstep: the plant in-process, virtual time, as fast as it goes."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from time import perf_counter

from .config import Loaded
from .lockstep import Lockstep
from .log import LogWriter
from .modes import Command, Mode
from .outcome import END_LIMIT_S, Outcome, outcome
from .record import NO_TIMING, RecordWriter
from .screen import CLEAR_BELOW
from .session import build, fingerprint
from .summary import Summary, as_json

DEFAULT_S = 30.0


def run(loaded: Loaded, log: Path, duration: float | None, live: bool) -> Outcome:
    """Run for a duration [s] of virtual time, bring the machine to rest, write the log and sum up.

    Ctrl-C ends the duration.
    """
    session = build(loaded)
    lockstep = Lockstep(session)
    memory, rate = session.memory, loaded.config.loop.rate
    ticks = round((duration or DEFAULT_S) * rate)
    writer = RecordWriter(memory)
    summary = Summary.of(session)
    clear = f"\r{CLEAR_BELOW}" if live else ""
    begin = perf_counter()
    with FileIO(str(log), "w") as stream, _interrupts() as interrupted:
        # tick 0 at time 0: the same session gives the same file
        recording = LogWriter(stream, loaded, fingerprint(session), writer.fixed.dtype, 0)

        def keep() -> None:
            tick = lockstep.inputs.tick
            recording.tick(tick, writer.write(lockstep.inputs, lockstep.outputs, NO_TIMING))
            summary.add(writer.fixed[0])
            for text in lockstep.outputs.events:
                recording.event(tick, text)
                print(f"{clear}{tick / rate:9.3f} s  {text}", file=sys.stderr)
            if live and tick % 500 == 0:
                sys.stderr.write(f"{clear}{tick / rate:6.1f} s {memory.mode.name}")
                sys.stderr.flush()

        while lockstep.inputs.tick + 1 < ticks and memory.mode is not Mode.FAILED and not interrupted:
            lockstep.tick()
            keep()
        lockstep.tick(Command.END)
        keep()
        latest = lockstep.inputs.tick + END_LIMIT_S * rate
        while not memory.secured and lockstep.inputs.tick < latest:
            lockstep.tick()
            keep()
        sys.stderr.write(clear)
        report = summary.report(0)
        recording.finish(as_json(report))
    speed_x = round((lockstep.inputs.tick + 1) / rate / (perf_counter() - begin), 2)
    return outcome(memory, report, speed_x)


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Collects Ctrl-C and requests to terminate instead of dying of them."""
    found: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda received, _: found.append(received)) for number in numbers]
    try:
        yield found
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
