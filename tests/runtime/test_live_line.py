"""The live line: what it says was measured, and it fits any window."""

from __future__ import annotations

import pytest
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.live_line import LiveLine
from hapticd.runtime.live.orders import possible
from hapticd.runtime.live.screen import fit
from hapticd.runtime.recording.record import NO_TIMING, RecordWriter
from hapticd.runtime.recording.summary import Summary, table

from .conftest import MACHINES, Bench


class Watched:
    """A session in lockstep and the live line of its recorder."""

    def __init__(self, machine: str, *changes: tuple[str, str]) -> None:
        self.bench = Bench(*changes, machine=machine)
        session = self.bench.lockstep.session
        self._writer = RecordWriter(session.cycle)
        self.summary = Summary.of(session)
        self.line = LiveLine(session, self.summary, possible(session.config), 30.0)

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.bench.run(1)
            self._writer.write(self.bench.lockstep.inputs, NO_TIMING)
            self.summary.add(self._writer.fixed[0])

    def until(self, mode: Mode) -> None:
        while self.bench.mode is not mode:
            self.run(1)

    @property
    def text(self) -> str:
        return "  ".join(self.line.words())


def test_nothing_is_said_before_it_is_measured(machine: str) -> None:
    watched = Watched(machine)
    assert watched.line.words() == ["waiting for the first tick"]
    while watched.bench.mode is Mode.BRINGUP:
        watched.run(1)
        if watched.bench.mode is Mode.BRINGUP:
            assert "BRINGUP" in watched.text
        assert not any(word in watched.text for word in ("force", "dead-man", "at ", "wall"))
    watched.run(1)
    assert "READY" in watched.text and "dead-man open" in watched.text
    assert watched.summary.measured


def test_the_summary_holds_no_value_from_before_the_first_measurement(machine: str) -> None:
    watched = Watched(machine)
    watched.until(Mode.READY)
    assert all(extent.low > extent.high for extent in watched.summary.extents)
    watched.run(50)
    measured = watched.bench.cycle.machine.position[:4]  # both machines name their joints first
    for extent, value in zip(watched.summary.extents, measured, strict=False):
        assert extent.low == pytest.approx(value, abs=0.01) and extent.high == pytest.approx(value, abs=0.01)


def test_the_line_says_what_the_machine_waits_for(machine: str) -> None:
    watched = Watched(machine)
    watched.until(Mode.READY)
    watched.run(1)
    assert "next: p press" in watched.text
    watched.until(Mode.ENGAGING)
    watched.run(20)
    assert "dead-man pressed" in watched.text and "next" not in watched.text and "force" in watched.text
    watched.bench.plc.emergency_stop = (True, True)
    watched.until(Mode.STOPPED)
    watched.run(2)
    assert "next: l let go" in watched.text
    watched.bench.press(False)
    watched.run(3)
    assert "next: r reset" in watched.text


def test_a_machine_that_is_armed_by_command_says_so() -> None:
    watched = Watched("giant", ('by = "dead-man"', 'by = "command"'))
    watched.until(Mode.READY)
    watched.run(1)
    assert "next: + arm, p press" in watched.text


def test_where_nobody_can_type_no_key_is_named() -> None:
    watched = Watched("giant", ('by = "dead-man"', 'by = "command"'))
    session = watched.bench.lockstep.session
    watched.line = LiveLine(session, watched.summary, (), 0.0)
    watched.until(Mode.READY)
    watched.run(1)
    assert "next: arm, press the dead-man" in watched.text and "0.1 s READY" in watched.text


def test_the_time_of_a_plant_that_stood_still_does_not_pass_the_end_of_the_session(machine: str) -> None:
    watched = Watched(machine)
    watched.run(100)
    assert watched.summary.last is not None
    late = watched.summary.last.copy()
    late["tick"] += 40_000  # periods of the host that the plant had no part in
    watched.summary.add(late)
    assert watched.text.startswith("  0.1/30 s ")


@pytest.fixture(scope="module", params=MACHINES)
def active(request: pytest.FixtureRequest) -> Watched:
    """A session that is rendered since 0.5 s; nothing here changes it."""
    watched = Watched(request.param)
    watched.until(Mode.ACTIVE)
    watched.run(500)
    return watched


@pytest.mark.parametrize("columns", [40, 80, 200])
def test_the_essentials_fit_any_window(active: Watched, columns: int) -> None:
    line = fit(active.line.words(), columns - 1)
    assert len(line) < columns
    assert "/30 s ACTIVE" in line and "dead-man pressed" in line


def test_the_summary_fits_eighty_columns(active: Watched) -> None:
    text = table(active.summary.report(12_345))
    assert max(map(len, text.splitlines())) < 80
    for name in (spec.name for spec in active.summary.figures.specs):
        assert name in text
