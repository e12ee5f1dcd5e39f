import json
import os
from collections.abc import Callable
from errno import ENOSPC
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from hapticd.models import Robot
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.known import built_in
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.core.scene import Grip
from hapticd.runtime.recording.channels import Group, slacks
from hapticd.runtime.recording.log import LoggedEvent, open_log
from hapticd.runtime.timing.forensics import LateTick
from hapticd.view.report import page, pretty
from hapticd.view.session import Recorded, read
from hapticd.view.work import Work

VOID = {"meta", "rect", "path", "polyline", "br"}


class Page(HTMLParser):
    """Checks that every element is closed, and keeps the words and what would be loaded."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.words, self.loads, self._open = "", [], []  # type: ignore[var-annotated]
        self.feed(text)
        assert not self._open, self._open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, Any]]) -> None:
        self.loads += [value for name, value in attrs if name in ("src", "href")]
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, Any]]) -> None:
        pass

    def handle_data(self, data: str) -> None:
        self.words += data


@pytest.mark.parametrize("machine", built_in())
def test_a_page_that_needs_nothing_else(machine: str, recorded: Callable[[str], Path]) -> None:
    found = read(open_log(str(recorded(machine))))
    text = page(found)
    assert len(text) < 2e6
    read_back = Page(text)
    assert not read_back.loads
    assert "://" not in text
    for channel in found.channels.specs[found.channels.groups[Group.LIMITS]]:
        assert channel.name in read_back.words
    for _, level, _ in slacks(found.channels.specs):
        assert level in read_back.words
    assert "frames received" in read_back.words
    for event in found.events:
        assert event.text in read_back.words
    assert ("work of the hand" in read_back.words) == (found.session.system.scene is not None)


@pytest.fixture(scope="module")
def found(recorded: Callable[[str], Path]) -> Recorded:
    return read(open_log(str(recorded("giant"))))


def test_columns_hold_what_the_records_hold(found: Recorded) -> None:
    """The lowest, highest and mean handle, against the values of every record."""
    records = [record.fixed for record in found.log.records()]
    up = next(i for i, fixed in enumerate(records) if fixed["mode"] != Mode.BRINGUP) + 1
    x = [fixed["state"]["wrench"][0] for fixed in records[up:]]
    names = [spec.name for spec in found.channels.specs]
    at = names.index("force x")
    assert found.columns.low[:, at].min() == min(x)
    assert found.columns.high[:, at].max() == max(x)
    assert found.seconds == pytest.approx(len(records) / found.rate)
    assert [mode for mode, _, _ in found.modes][:3] == [Mode.BRINGUP, Mode.READY, Mode.ENABLING]
    assert all(a[2] == b[1] for a, b in zip(found.modes[:-1], found.modes[1:], strict=True))


def test_touched_ends(found: Recorded) -> None:
    at = found.channels.groups[Group.LIMITS].start + 1  # joint 2
    spec = found.channels.specs[at]
    low, high = found.columns.low[:, at].copy(), found.columns.high[:, at].copy()
    try:
        found.columns.low[:2, at] = spec.lower
        found.columns.high[2:4, at] = spec.upper + 0.1
        touched = found.touched(at)
    finally:
        found.columns.low[:, at], found.columns.high[:, at] = low, high
    assert list(touched[:4]) == [-1, -1, 1, 1]
    assert not touched[4:].any()


def test_what_a_recording_says_is_never_markup(found: Recorded) -> None:
    evil = '<script>alert("1")</script>'
    found.events.append(LoggedEvent(10, evil))
    late = LateTick(3, 0, 0, 300.0, 200.0, {}, [], 0, 0, 0, 0.0, evil)
    found.late.append(late)
    found.lateness.append((50.0, 3))
    summary = found.summary
    assert summary is not None
    found.summary = msgspec.structs.replace(summary, compute_us={**summary.compute_us, "max": 9.0}, stop=evil)
    try:
        text = page(found)
    finally:
        found.summary = summary
        found.events.pop(), found.late.pop(), found.lateness.pop()
    assert evil not in text
    assert text.count("alert(&quot;1&quot;)") == 3


def test_units_are_written_for_people() -> None:
    assert pretty("sqrt(kg) m/s^2") == "√kg m/s²"
    assert pretty("rad/s^2, m/s^2") == "rad/s², m/s²"


class Lift:
    """A hand that pulls with a force along the way."""

    parts = ("",)
    grips = (Grip("", "handle"),)
    boxes = planes = ()

    def posture(self, state: Any) -> Any:
        return state[:8]

    def wrench(self, state: Any) -> Any:
        return state[8:]

    def twin(self, state: Any) -> None:
        pass


def test_work_is_force_along_the_way_and_torque_along_the_turn() -> None:
    """A constant force does F (b - a) on any path; a constant torque about the axis of a turn its angle."""
    from hapticd.configs import read_text

    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf")
    rng = np.random.default_rng(3)
    start, end = rng.uniform(-0.5, 0.5, 8), rng.uniform(-0.5, 0.5, 8)
    force = np.array([3.0, -5.0, 7.0, 0.0, 0.0, 0.0])
    work = Work(robot, Lift())  # type: ignore[arg-type]
    for share in np.linspace(0.0, 1.0, 50):
        total = work.add(np.concatenate([start + share * (end - start), force]))  # type: ignore[arg-type]
    way = robot.placement(end, "handle")[:3, 3] - robot.placement(start, "handle")[:3, 3]
    assert total == pytest.approx(float(force[:3] @ way), rel=1e-9)

    work, turn = Work(robot, Lift()), np.array([0, 0, 0, 0, 0, 0, 0, 0.7])  # type: ignore[arg-type]
    axis = robot.placement(start, "handle")[:3, 2]
    for share in np.linspace(0.0, 1.0, 50):
        total = work.add(np.concatenate([start + share * turn, np.zeros(3), 2.0 * axis]))  # type: ignore[arg-type]
    angle = pin.log3(
        robot.placement(start + turn, "handle")[:3, :3] @ robot.placement(start, "handle")[:3, :3].T
    )
    assert total == pytest.approx(2.0 * float(axis @ angle), rel=1e-9)


def test_command(recorded: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = str(recorded("giant"))
    out = tmp_path / "a.html"
    out.write_text("an older page")
    assert main(["report", log, "--out", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["report"] == str(out) and said["bytes"] == out.stat().st_size > 10_000
    assert [path.name for path in tmp_path.iterdir()] == ["a.html"]


def test_a_session_of_a_moment_has_a_page_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It ended before anything of it was to be drawn."""
    log = str(tmp_path / "a.mcap")
    assert main(["run", "giant", "--lockstep", "--duration", "0.01", "--log", log, "--json"]) in (0, 1)
    capsys.readouterr()
    assert main(["report", log]) == 0
    assert "giant" in Page((tmp_path / "a.html").read_text()).words


@pytest.mark.parametrize(
    ("out", "says"), [("log.mcap", "does not end in .html"), ("none/a.html", "no folder"), (".html", "")]
)
def test_no_other_file_is_replaced(
    out: str, says: str, recorded: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / out
    if not says:
        place = tmp_path / "folder.html"
        place.mkdir()
    assert main(["report", str(recorded("giant")), "--out", str(place)]) == 2
    assert (says or "is a folder") in capsys.readouterr().err


def test_a_page_that_cannot_be_written_is_named(
    recorded: Callable[[str], Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(path: Path, content: bytes) -> None:
        raise OSError(ENOSPC, os.strerror(ENOSPC), str(path))

    monkeypatch.setattr(Path, "write_bytes", full)
    place = tmp_path / "a.html"
    assert main(["report", str(recorded("giant")), "--out", str(place)]) == 2
    assert f"cannot write {place}: {os.strerror(ENOSPC)}" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
