"""What the recorder makes of what the daemon tells it: for the log, for the screen, for the summary."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hapticd.runtime.configuration.session import build
from hapticd.runtime.live.recorder import Recorder
from hapticd.runtime.live.recorder_link import RecorderLink
from hapticd.runtime.recording.summary import table
from hapticd.runtime.timing.forensics import LateTick
from hapticd.runtime.timing.watch import Overstay

from .conftest import loaded

TYPED = "runtime/live/console.py:1 Console._typed"
LATE = LateTick(7, 1, 0, 900.0, 200.0, {"cycle": 200.0}, [(TYPED, 850.0)], 0, 0, 0, 0.0, TYPED)


class Told:
    """A recorder without a process, and what its log and its screen were told."""

    def __init__(self) -> None:
        self.link = RecorderLink(Path("none.mcap"))
        self.logged: list[str] = []
        self.shown: list[str] = []
        log: Any = SimpleNamespace(
            full=None,
            flush=lambda: None,
            event=lambda tick, event: self.logged.append(str(event)),
            late=lambda tick, late: None,
        )
        screen: Any = SimpleNamespace(message=self.shown.append)
        session = build(loaded())
        self.recorder = Recorder(session, self.link._ring, log, None, screen)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def session_told() -> Iterator[Told]:
    yield Told()


def test_a_callback_that_overstays_is_for_the_log_and_one_that_cost_a_tick_for_people(
    session_told: Told,
) -> None:
    told = session_told
    for _ in range(2):
        told.link.overstay(5, Overstay(TYPED, 109.0, 100.0))
    told.recorder.drain()
    assert told.logged == [f"warning: {TYPED} took 109 us; between ticks it may take 100 us"]
    assert told.shown == []
    assert "overstayed" not in summed_up(told)
    for _ in range(2):
        told.link.late(LATE)
    told.recorder.drain()
    assert told.shown == [f"    0.007 s  warning: a late tick: {TYPED} took 850 us"]
    assert f"overstayed: {TYPED}, 2 times, at most 109 us of 100 us" in summed_up(told)


def test_a_person_who_took_over_is_in_the_summary_and_has_no_end_on_the_line(session_told: Told) -> None:
    recorder = session_told.recorder
    assert not recorder.report().led
    session_told.link.led(endless=False)
    recorder.drain()
    assert recorder.report().led and not recorder.endless
    session_told.link.led(endless=True)
    recorder.drain()
    assert recorder.endless


def summed_up(told: Told) -> str:
    told.recorder.summary.compute.add(200_000)
    return " ".join(table(told.recorder.report()).split())
