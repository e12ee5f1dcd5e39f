"""A recorded session of both stations in lockstep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter

import msgspec

from ...runtime.configuration.config import Loaded
from ...runtime.core.events import Event
from ...runtime.core.modes import Mode
from ...runtime.live.interrupts import heard, show
from ...runtime.live.lockstep import unswept
from ...runtime.live.outcome import Outcome
from ...runtime.live.recorded import Recorded
from ...runtime.recording.summary import table
from ...sim.peg_task import PegTask
from .pair import Pair
from .peg import figures, told

NAMES = ("operator", "avatar")
DEFAULT_S = 30.0


def pair_run(
    pair: Pair, stations: Sequence[Loaded], logs: Sequence[Path], duration: float | None, tell: bool
) -> tuple[list[Outcome], float]:
    """Run both for a duration [s], bring both to rest, and complete both logs.

    Returns:
        What became of each, and how many times faster than real time both ran together.
    """
    signals: list[int] = []
    begin = perf_counter()
    with heard(signals.append), unswept():
        both = recorded(pair, stations, logs, [teller(name, tell) for name in NAMES])
        torn = _run(pair, both, ticks(pair, stations, duration), signals)
    for each in both:
        each.ending.signals = tuple(signals)
    speed = round(both[0].ticks * pair.dt / (perf_counter() - begin), 2)
    return [each.outcome(torn, speed) for each in both], speed


def _run(pair: Pair, both: Sequence[Recorded], count: int, signals: Sequence[int]) -> OSError | None:
    """What the disk said, if it took no more."""
    operator, avatar = both
    try:
        while operator.ticks < count and not (signals or any(over(each) for each in both)):
            pair.tick(operator.step, avatar.step)
        pair.tick(operator.end, avatar.end)
        while not all(each.ended for each in both) and len(signals) < 2:
            pair.tick(operator.step, avatar.step)
        for each in both:
            each.finish()
    except OSError as error:
        return error
    finally:
        for each in both:
            each.close()
    return None


def recorded(
    pair: Pair,
    stations: Sequence[Loaded],
    logs: Sequence[Path],
    tellers: Sequence[Callable[[float, Event], None]],
) -> list[Recorded]:
    """Both sessions, and the beginning of their logs.

    Raises:
        LogWriteError: one of these cannot be written.
    """
    sessions = zip((pair.operator, pair.avatar), stations, logs, tellers, strict=True)
    return [Recorded(*each) for each in sessions]


def ticks(pair: Pair, stations: Sequence[Loaded], duration: float | None) -> int:
    """Of a session of a duration [s], or of that which the operator's configuration says."""
    return round((duration or stations[0].config.loop.duration or DEFAULT_S) / pair.dt)


def over(each: Recorded) -> bool:
    """Whether a session cannot go on."""
    return each.stream.full is not None or each.lockstep.mode is Mode.FAILED


def teller(name: str, tell: bool, say: Callable[[str], object] = show) -> Callable[[float, Event], None]:
    """What tells people of a station's events, or nothing."""

    def told(time: float, event: Event) -> None:
        if tell:
            say(f"{time:9.3f} s  {name:8}  {event}\n")

    return told


def report(
    stations: Sequence[Loaded],
    logs: Sequence[Path],
    outcomes: Sequence[Outcome],
    speed: float,
    as_json: bool,
    task: PegTask | None = None,
) -> str:
    """Both summaries, and what became of a task, for people or as one JSON object."""
    if as_json:
        rows = zip(NAMES, logs, outcomes, strict=True)
        content: dict[str, object] = {
            name: {
                "status": outcome.status,
                "message": outcome.message,
                "log": str(log),
                "report": outcome.report,
            }
            for name, log, outcome in rows
        }
        if task is not None:
            content["scene"] = figures(task)
        return msgspec.json.encode({**content, "speed_x": speed}).decode()
    lines: list[str] = []
    for name, log, outcome in zip(NAMES, logs, outcomes, strict=True):
        lines += [f"--- {name}", *([table(outcome.report)] if outcome.report else []), f"log: {log}"]
        lines += [outcome.message] if outcome.message else []
    lines += [told(task)] if task is not None else []
    return "\n".join([*lines, f"lockstep of both: {speed:g} times real time"])
