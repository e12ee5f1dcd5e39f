"""Frames hold what the records hold, and a terminal shows the essentials of one."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.recording.channels import HEARD, MET, PROVEN, SLACK, STATUS, Channel, Group
from hapticd.runtime.recording.frames import MOST_EVENTS, Frame, FrameMaker, Said, Stored, bars
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.published import SessionError
from hapticd.runtime.timing.histogram import Histogram
from hapticd.view import source
from hapticd.view.source import LEAST_TICKS, frames_of
from hapticd.view.top import BAR, rows, screen


def test_a_frame_is_lowest_highest_and_mean_of_its_ticks(recorded: Callable[[str], Path]) -> None:
    log = open_log(str(recorded("giant")))
    session = build(log.loaded)
    frames = frames_of(log, session)
    records = [record.fixed for record in log.records()]
    assert sum(frame.ticks for frame in frames) == len(records)
    assert not frames[0].mean  # bring-up has measured nothing
    k = [spec.name for spec in FrameMaker(session).channels.specs].index("force x")
    at = 50
    part = [fixed["state"]["wrench"][0] for fixed in records[LEAST_TICKS * at : LEAST_TICKS * (at + 1)]]
    frame = frames[at]
    assert (frame.low[k], frame.high[k]) == (min(part), max(part))
    assert frame.mean[k] == pytest.approx(np.mean(part), abs=1e-12)
    last = records[LEAST_TICKS * (at + 1) - 1]
    assert frame.tick == last["tick"] and frame.mode == Mode(int(last["mode"])).name
    assert frame.posture == [*last["state"]["axis"], *last["state"]["link"]]
    assert frame.pressed is True and frame.e_stop_closed is True
    assert [text for each in frames for _, _, text in (tuple_of(said) for said in each.events)] == [
        event.text for event in log.events()
    ]


def tuple_of(said: Said) -> tuple[int, str, str]:
    return said.tick, said.severity, said.text


def test_a_flood_of_events_is_cut_and_counted(recorded: Callable[[str], Path]) -> None:
    log = open_log(str(recorded("giant")))
    maker = FrameMaker(build(log.loaded))
    assert maker.take({}, None) is None
    maker.tick(next(log.records()).fixed)
    for number in range(MOST_EVENTS + 7):
        maker.event(number, "note", str(number))
    frame = maker.take({"lost": 0}, None)
    assert frame is not None
    assert [said.text for said in frame.events] == [str(n) for n in range(7, MOST_EVENTS + 7)]
    assert frame.counts == {"lost": 0, "events left out": 7}
    assert maker.take({}, None) is None


def test_bars_are_half_octaves() -> None:
    histogram = Histogram()
    for us in (0.5, 1.9, 100.0, 1e9):
        histogram.add(round(1e3 * us))
    found = bars(histogram)
    assert sum(found) == 4
    assert found[0] == 1 and found[2] == 1 and found[14] == 1 and found[-1] == 1


@dataclass
class Watching:
    """A session that is watched."""

    channels: Sequence[Channel]
    name: str = "giant"
    rate: float = 1000.0
    remarks: Mapping[int, str] = field(default_factory=lambda: {3: "gave up"})


def test_a_terminal_shows_the_essentials() -> None:
    channels = [
        Channel("lateness", "us", Group.PUNCTUALITY),
        *(Channel(f"force {axis}", "N", Group.HAND) for axis in "xyz"),
        Channel("elbow", "rad", Group.LIMITS, -1.0, 1.0),
        Channel("slide", "m", Group.LIMITS, 0.0, 2.0),
    ]
    values = [30.0, 3.0, 4.0, 0.0, 0.999, 1.0]
    frame = Frame(
        **{"tick": 2500, "ticks": 20, "published_ns": 0, "mode": "STOPPED", "stop": "e_stop"},
        **{
            "pressed": True,
            "since": 500,
            "e_stop_closed": False,
            "low": values,
            "high": values,
            "mean": values,
        },
        counts={"ticks skipped": 3, "records lost": 0},
    )
    giant = Watching(channels)
    shown = rows(frame, giant, [Said(2400, "stop", "the stop")], (80, 40))
    text = "\n".join(shown)
    assert shown[0] == "giant  2.5 s  STOPPED  (e_stop)"
    assert "dead-man pressed for 2.0 s  EMERGENCY STOP PRESSED" in text
    assert "hand 5.0 N" in text and "ticks skipped 3" in text and "records lost" not in text
    assert "    2.400 s  the stop" in text
    elbow, slide = (row for row in shown if row.startswith(("elbow", "slide")))
    assert elbow.endswith("at its upper end") and "at its" not in slide
    assert slide.index("|") - slide.index("[") - 1 == BAR // 2
    assert rows(frame, giant, [], (80, 40), 0.9)[0] == shown[0]
    silent = rows(frame, giant, [Said(2400, "stop", "the stop")], (80, 40), 3.2)
    assert silent == ["NOTHING HAS COME FOR 3 s: what stands here is old", *shown]
    few = rows(frame, giant, [], (80, 9))
    assert any(row == "and 2 more" for row in few)
    drawn = screen(shown, 30, 5)
    assert drawn.count("\r\n") == 4 and all(len(row) < 34 for row in drawn.split("\x1b[K\r\n"))


def test_a_terminal_of_80_columns_shows_solver_dead_man_bus_and_recording() -> None:
    channels = [
        Channel(HEARD, "ms", Group.BUS),
        Channel(STATUS, "", Group.SOLVER),
        Channel(PROVEN, "", Group.SOLVER),
        Channel(f"{SLACK}box", "m", Group.SOLVER),
        Channel(f"{SLACK}posture", "rad/s^2", Group.SOLVER),
    ]

    def frame(mode: Mode, values: list[float]) -> Frame:
        return Frame(
            **{
                "tick": 2500,
                "ticks": 20,
                "published_ns": 0,
                "mode": mode.name,
                "pressed": True,
                "since": 400,
            },
            **{"e_stop_closed": True, "low": values, "high": values, "mean": values, "received": 64334},
            doing=["left linked 3 N (own limit 2.1 N m)", "right linked 2 N", "joint 3 gives way"],
            stored=Stored(4_654_881, 512, 1 << 20, 12_300_000_000),
        )

    shown = rows(frame(Mode.ACTIVE, [7.0, 3.0, 1.0, MET / 2, 33.71]), Watching(channels), [], (80, 40))
    assert all(len(row) < 80 for row in shown)
    assert "dead-man pressed for 2.1 s  heard 7 ms ago" in shown
    assert "solver: gave up  1 of 2 levels proven  posture yields 33.7 rad/s^2" in shown
    assert "[left linked 3 N (own limit 2.1 N m)]  [right linked 2 N]  [joint 3 gives way]" in shown
    assert "frames received 64334  recorded 4.7 MB  12.3 GB free  buffer 0.0 % full" in shown
    assert shown[-1] == "  nothing lost"
    shown = rows(frame(Mode.ACTIVE, [0.0, 0.0, 2.0, 0.0, 0.0]), Watching(channels), [], (80, 40))
    assert "dead-man pressed for 2.1 s  heard in this tick" in shown
    assert "solver: solved  2 of 2 levels proven  all met" in shown
    assert not any(
        "solver" in row for row in rows(frame(Mode.READY, [0.0] * 5), Watching(channels), [], (80, 40))
    )


def test_a_frame_has_the_words_that_a_machine_says_of_itself(recorded: Callable[[str], Path]) -> None:
    log = open_log(str(recorded("giant")))
    session = build(log.loaded)
    said = {frame.mode: frame.doing for frame in frames_of(log, session)}
    assert said["READY"] == [] and any(word.startswith("force ") for word in said["ENGAGING"])


def test_who_waits_for_a_session_that_does_not_come_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(source, "START_S", 1.3)
    with pytest.raises(SessionError, match="shows no session that can be watched"):
        source.awaited(os.getpid())
    assert capsys.readouterr().err.count(f"waiting for the session of process {os.getpid()}") == 1
