"""A session in which the machine never became active says so, and why; it is no success."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.live.never_active import first_press, never_active
from hapticd.runtime.live.outcome import Outcome
from hapticd.runtime.recording.summary import Report, Summary
from hapticd.testing.terminal import CTRL_C, HAPTICD, Terminal

from .conftest import Bench, loaded

FAST = ("scan = 4000 ", "scan = 0 ")
PRESS = 'dead_man = [{ at = "0.3 s", pressed = true }]'
ELSEWHERE = (
    'posture = "1.024066 -0.156786 0.230091 1.655231 rad"',
    'posture = "1.9 2.5 1.7 2.1 rad"',
)
"""The hand waits elsewhere, and pulls at a machine that is not to be started so."""


def ran(path: Path, *options: str) -> list[str]:
    log = path.with_name("session.mcap")
    return ["run", str(path), "--lockstep", "--log", str(log), *options]


def test_a_start_that_was_refused_is_told_with_its_reason(
    write_config: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_config(FAST, ELSEWHERE, machine="rhi")
    assert main(ran(path, "--duration", "1", "--json")) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["never_active"].startswith("not started: the handle is pulled with 40.0 N")
    assert found["status"] == 1 and found["stop"] == ""
    assert found["never_active"] in found["verdict"]


def test_a_machine_that_nobody_started_is_no_success(
    write_config: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(ran(write_config(FAST, (PRESS, "dead_man = []"), machine="rhi"), "--duration", "0.5")) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "verdict: the machine never became active: nobody pressed the dead-man switch" in said


@pytest.mark.parametrize(
    ("seconds", "why"), [("0.2", "before the simulated hand pressed"), ("1", "before it had engaged")]
)
def test_a_session_that_was_to_be_short_says_so_and_is_one(
    seconds: str, why: str, write_config: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(ran(write_config(FAST, machine="rhi"), "--duration", seconds, "--json")) == 0
    found = json.loads(capsys.readouterr().out)
    assert why in found["never_active"] and found["status"] == 0


@pytest.mark.live
def test_who_quits_a_machine_that_waits_has_what_was_asked_for(tmp_path: Path) -> None:
    (tmp_path / "rhi.urdf").write_text(loaded(machine="rhi").model_text)
    (tmp_path / "mine.toml").write_text(loaded(FAST, (PRESS, "dead_man = []"), machine="rhi").text)
    for key, status in (("q", 0), (CTRL_C, 130)):
        terminal = Terminal([*HAPTICD, "run", "mine.toml", "--duration", "300"], tmp_path)
        try:
            terminal.until_stays("READY")
            terminal.type(key)
            assert terminal.end().status == status, terminal.emulator.text
            terminal.until_seen("the machine never became active: nobody pressed the dead-man switch")
        finally:
            terminal.dispose()


def report(**modes: int) -> Report:
    """A session of 10 s."""
    empty = Summary.of(build(config.load("rhi"))).report(0)
    return msgspec.structs.replace(empty, ticks=10_000, modes=modes)


def test_an_active_machine_and_one_without_a_summary_have_nothing_to_explain() -> None:
    rhi = config.load("rhi").config
    assert never_active(rhi, Outcome(report(READY=300, ACTIVE=9700), 0, "")) is None
    assert never_active(rhi, Outcome(None, 1, "no log")) is None


def test_the_last_refusal_is_forgotten_once_the_machine_starts() -> None:
    bench = Bench(FAST, machine="rhi")
    bench.run(400)
    start = bench.cycle.start
    assert start.refused == ""
    still = Bench(FAST, ELSEWHERE, machine="rhi")
    still.run(400)
    assert "the handle is pulled" in still.cycle.start.refused


def test_of_several_switches_the_last_press_counts() -> None:
    assert first_press(config.load("rhi").config) == 0.3
    silent = loaded((PRESS, "dead_man = []"), machine="rhi").config
    assert first_press(silent) is None
    both = loaded(("seed = 1\n", 'seed = 1\nsupervisor = [{ at = "2 s", pressed = true }]\n'), machine="rhi")
    assert first_press(both.config) == 2.0
