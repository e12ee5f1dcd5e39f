"""Ctrl-C, a termination, a closed terminal at any moment: a line, the right status, nothing left behind."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live import interrupts
from hapticd.runtime.recording.log import open_log
from hapticd.testing.terminal import CTRL_C, HAPTICD, Ended, Terminal, child, complete

MOMENTS = [round(0.15 * k, 2) for k in range(1, 15)]
"""After the start [s]: from the import of the first module to the first ticks."""


Open = Callable[..., Terminal]


def said(folder: Path) -> str:
    return (folder / "stderr.txt").read_text(errors="replace")


def check_order(folder: Path, terminal: Terminal, ended: Ended) -> None:
    """No traceback, nobody left, no recording without an end, one line."""
    text = said(folder) + ended.said
    assert "Traceback" not in text
    assert "Exception ignored" not in text
    assert terminal.survivors() == []
    assert all(complete(log) for log in folder.rglob("*.mcap"))
    told = [line for line in text.split("\n") if line.startswith("hapticd: ")]
    assert len(told) == 1, text


def status_of(folder: Path, number: int) -> int:
    """The exit status that is due: a machine that moved was brought to rest first."""
    return 0 if "ENABLING" in said(folder) else 128 + number


@pytest.mark.parametrize("moment", MOMENTS)
def test_ctrl_c_while_it_starts_ends_it_with_a_line_and_status_130(
    open_hapticd: Open, tmp_path: Path, machine: str, moment: float
) -> None:
    terminal = open_hapticd("run", machine)
    terminal.wait_until(moment)
    terminal.type(CTRL_C)
    ended = terminal.end()
    check_order(tmp_path, terminal, ended)
    assert ended.status == status_of(tmp_path, signal.SIGINT)
    assert "hapticd: interrupted" in said(tmp_path)


@pytest.mark.parametrize("moment", [0.4, 0.9, 1.4, 2.0])
@pytest.mark.parametrize(
    ("number", "word"), [(signal.SIGTERM, "terminated"), (signal.SIGHUP, "the terminal was closed")]
)
def test_other_signals_that_ask_for_an_end_are_told_by_their_name(
    open_hapticd: Open, tmp_path: Path, number: int, word: str, moment: float
) -> None:
    terminal = open_hapticd("run", "giant")
    terminal.wait_until(moment)
    os.kill(terminal.pid, number)
    ended = terminal.end()
    check_order(tmp_path, terminal, ended)
    assert ended.status == status_of(tmp_path, number)
    assert f"hapticd: {word}" in said(tmp_path)


@pytest.mark.parametrize(
    ("number", "word"),
    [
        (signal.SIGINT, "interrupted"),
        (signal.SIGTERM, "terminated"),
        (signal.SIGHUP, "the terminal was closed"),
    ],
)
def test_a_signal_while_the_shell_is_still_busy_is_told_too(tmp_path: Path, number: int, word: str) -> None:
    slow = tmp_path / "dirname"
    slow.write_text('#!/bin/sh\n: > begun; sleep 0.5; exec /usr/bin/dirname "$@"\n')
    slow.chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"}
    process = subprocess.Popen(
        [*HAPTICD, "run", "giant"],
        cwd=tmp_path,
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),  # the tests may run in the background
    )
    deadline = time.monotonic() + 60.0
    while not (tmp_path / "begun").exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    os.killpg(process.pid, number)
    _, told = process.communicate(timeout=60.0)
    assert told.endswith(f"hapticd: {word}\n") and told.count("hapticd: ") == 1
    assert process.returncode == 128 + number


def wait_until_moving(folder: Path) -> None:
    deadline = time.monotonic() + 60.0
    while "ENGAGING" not in said(folder):
        assert time.monotonic() < deadline, said(folder)
        time.sleep(0.02)


def last_mode(folder: Path) -> Mode:
    (log,) = folder.rglob("*.mcap")
    *_, last = open_log(str(log)).records()
    return Mode(int(last.fixed["mode"]))


def test_ctrl_c_while_the_machine_moves_brings_it_to_rest_first(
    open_hapticd: Open, tmp_path: Path, machine: str
) -> None:
    terminal = open_hapticd("run", machine)
    wait_until_moving(tmp_path)
    terminal.type(CTRL_C)
    ended = terminal.end()
    check_order(tmp_path, terminal, ended)
    assert ended.status == 0
    assert last_mode(tmp_path) is Mode.STOPPED
    assert "hapticd: interrupted; the machine came to rest before the session ended" in said(tmp_path)
    assert "log:" in ended.said


def test_a_closed_window_brings_the_machine_to_rest_and_completes_the_log(
    open_terminal: Open, tmp_path: Path
) -> None:
    terminal = open_terminal([*HAPTICD, "run", "giant"], tmp_path)
    terminal.until_seen("ENGAGING")
    terminal.close_window()
    ended = terminal.end()
    assert ended.status == 0
    assert terminal.survivors() == []
    assert last_mode(tmp_path) is Mode.STOPPED


def test_ctrl_c_twice_ends_at_once_and_says_so(open_hapticd: Open, tmp_path: Path) -> None:
    terminal = open_hapticd("run", "giant")
    wait_until_moving(tmp_path)
    time.sleep(5.0)  # the hand walks; standstill takes a while
    terminal.type(CTRL_C)
    time.sleep(0.005)
    terminal.type(CTRL_C)
    ended = terminal.end()
    check_order(tmp_path, terminal, ended)
    if last_mode(tmp_path) is Mode.STOPPED:  # it was that quick
        return
    assert ended.status == 130
    assert "interrupted, and again: ended before the machine was at rest" in said(tmp_path)
    assert re.search(r"every simulated drive is safe after \d+ ms of plant time", said(tmp_path))


def test_a_recorder_that_takes_its_time_is_waited_for_until_the_second_ctrl_c(
    open_hapticd: Open, tmp_path: Path
) -> None:
    terminal = open_hapticd("run", "giant", "--duration", "1")
    wait_until_moving(tmp_path)
    recorder = child(terminal.pid, "recorder")
    os.kill(recorder, signal.SIGSTOP)
    try:
        time.sleep(3.0)
        terminal.type(CTRL_C)
        deadline = time.monotonic() + 20.0
        while "the log is being completed" not in said(tmp_path):
            assert time.monotonic() < deadline, said(tmp_path)
            time.sleep(0.02)
        terminal.type(CTRL_C)
        ended = terminal.end()
    finally:
        os.kill(recorder, signal.SIGCONT)
    assert ended.seconds < 5.0
    assert ended.status == 130
    assert "the recorder goes on to complete the log" in said(tmp_path)
    assert terminal.survivors() == []
    assert all(complete(log) for log in tmp_path.rglob("*.mcap"))
    assert "Traceback" not in said(tmp_path)


@pytest.mark.parametrize("moment", [0.3, 0.8, 1.3, 3.0])
def test_ctrl_c_in_lockstep_completes_the_log_or_leaves_none(
    open_hapticd: Open, tmp_path: Path, machine: str, moment: float
) -> None:
    terminal = open_hapticd("run", machine, "--lockstep", "--duration", "600")
    terminal.wait_until(moment)
    terminal.type(CTRL_C)
    ended = terminal.end()
    check_order(tmp_path, terminal, ended)
    assert ended.status == status_of(tmp_path, signal.SIGINT)


COMMANDS = {
    "check": ("check", "giant"),
    "doctor": ("doctor",),
    "jitter": ("bench", "jitter", "--rounds", "3"),
    "tick": ("bench", "tick", "--rounds", "3"),
    "experiment": ("experiment", "rhi_fig9"),
    "replay": ("replay", "recording.mcap"),
}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "recording.mcap"
    command = [*HAPTICD, "run", "rhi", "--lockstep", "--duration", "20", "--log", str(path)]
    subprocess.run(command, check=True, capture_output=True)
    return path


@pytest.mark.parametrize("moment", [0.6, 2.5])
@pytest.mark.parametrize("name", COMMANDS)
def test_ctrl_c_ends_every_command_and_whatever_it_started(
    open_hapticd: Open,
    tmp_path: Path,
    recording: Path,
    name: str,
    moment: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    (tmp_path / "recording.mcap").symlink_to(recording)
    terminal = open_hapticd(*COMMANDS[name])
    terminal.wait_until(moment)
    if terminal.process.poll() is not None:  # it was quicker
        return
    terminal.type(CTRL_C)
    ended = terminal.end()
    text = said(tmp_path) + ended.said
    assert "Traceback" not in text and "Exception ignored" not in text
    assert terminal.survivors() == []
    assert list((tmp_path / "tmp").iterdir()) == []
    if ended.status == 130:
        assert said(tmp_path).count("hapticd: interrupted") == 1
    else:
        assert name in ("check", "doctor", "replay")


def test_a_signal_after_the_last_word_leaves_the_status_as_it_is(tmp_path: Path) -> None:
    late = tmp_path / "late.py"
    late.write_text(
        "import atexit, os, runpy, signal\n"
        "atexit.register(os.kill, os.getpid(), signal.SIGINT)\n"
        "runpy.run_module('hapticd.runtime', run_name='__main__')\n"
    )
    ended = subprocess.run([sys.executable, late, "--nonsense"], capture_output=True, text=True)
    assert ended.returncode == 2
    assert "interrupted" not in ended.stderr


def test_who_holds_the_signals_back_gets_them_afterwards(tmp_path: Path) -> None:
    program = """
import os, signal, sys
from hapticd.runtime.live.interrupts import end_at_once, held
end_at_once()
with held():
    os.kill(os.getpid(), signal.SIGTERM)
    print("done", flush=True)
print("never")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (143, "done\n", "hapticd: terminated\n")


def test_under_nohup_a_closed_terminal_is_no_reason_to_end() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert signal.SIGHUP not in interrupts.asking()
    finally:
        signal.signal(signal.SIGHUP, before)
    assert signal.SIGINT in interrupts.asking()
