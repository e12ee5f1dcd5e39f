"""A recorded session in lockstep: the plant in-process, virtual time, as fast as it goes."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter

from ..configuration.config import Loaded
from ..configuration.session import build
from ..core.events import Event
from ..core.modes import Mode
from .interrupts import heard, show
from .lockstep import Lockstep, unswept
from .outcome import Outcome, called_off
from .recorded import Recorded
from .screen import CLEAR_BELOW

DEFAULT_S = 30.0


def run(loaded: Loaded, log: Path, duration: float | None, live: bool, quiet: bool = False) -> Outcome:
    """Run for a duration [s] of virtual time, bring the machine to rest, write the log and sum up.

    Without a duration it is that of the configuration; a quiet one tells nobody what happens in it.
    """
    signals: list[int] = []
    with heard(signals.append):
        session = build(loaded)
        lockstep = Lockstep(session)
        if signals:
            return called_off(signals[0])
        seconds = duration or loaded.config.loop.duration or DEFAULT_S
        with unswept():
            return _run(lockstep, loaded, log, seconds, live, quiet, signals)


def _run(
    lockstep: Lockstep,
    loaded: Loaded,
    log: Path,
    duration: float,
    live: bool,
    quiet: bool,
    signals: list[int],
) -> Outcome:
    """A signal ends the session, a second one does not wait for the machine to come to rest."""
    cycle, rate = lockstep.session.cycle, loaded.config.loop.rate
    ticks = round(duration * rate)
    clear = f"\r{CLEAR_BELOW}" if live else ""

    def say(time: float, event: Event) -> None:
        if not quiet:
            show(f"{clear}{time:9.3f} s  {event}\n")

    begin = perf_counter()
    torn: OSError | None = None
    recorded = Recorded(lockstep, loaded, log, say)
    try:
        while recorded.ticks < ticks and not (signals or recorded.stream.full or cycle.mode is Mode.FAILED):
            recorded.step()
            if live and recorded.ticks % 500 == 1:
                show(f"{clear}{(recorded.ticks - 1) / rate:6.1f} s {cycle.mode.name}")
        recorded.end()
        while not recorded.ended and len(signals) < 2:
            recorded.step()
        show(clear)
        recorded.finish()
    except OSError as error:
        torn = error
    finally:
        recorded.close()
    recorded.ending.signals = tuple(signals)
    return recorded.outcome(torn, round(recorded.ticks / rate / (perf_counter() - begin), 2))
