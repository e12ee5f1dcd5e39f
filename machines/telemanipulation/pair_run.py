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
    seconds = duration or stations[0].config.loop.duration or DEFAULT_S
    begin = perf_counter()
    with heard(signals.append), unswept():
        both = [
            Recorded(lockstep, loaded, log, _teller(name, tell))
            for lockstep, loaded, log, name in zip(
                (pair.operator, pair.avatar), stations, logs, NAMES, strict=True
            )
        ]
        torn = _run(pair, both, round(seconds / pair.dt), signals)
    for recorded in both:
        recorded.ending.signals = tuple(signals)
    speed = round(both[0].ticks * pair.dt / (perf_counter() - begin), 2)
    return [recorded.outcome(torn, speed) for recorded in both], speed


def _run(pair: Pair, both: Sequence[Recorded], ticks: int, signals: Sequence[int]) -> OSError | None:
    """What the disk said, if it took no more."""
    operator, avatar = both
    try:
        while operator.ticks < ticks and not (signals or any(_over(recorded) for recorded in both)):
            pair.tick(operator.step, avatar.step)
        pair.tick(operator.end, avatar.end)
        while not all(recorded.ended for recorded in both) and len(signals) < 2:
            pair.tick(operator.step, avatar.step)
        for recorded in both:
            recorded.finish()
    except OSError as error:
        return error
    finally:
        for recorded in both:
            recorded.close()
    return None


def _over(recorded: Recorded) -> bool:
    return recorded.stream.full is not None or recorded.lockstep.mode is Mode.FAILED


def _teller(name: str, tell: bool) -> Callable[[float, Event], None]:
    def say(time: float, event: Event) -> None:
        if tell:
            show(f"{time:9.3f} s  {name:8}  {event}\n")

    return say


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
