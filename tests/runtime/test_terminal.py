"""What a person sees and can do while a session runs, on a pseudo-terminal."""

from __future__ import annotations

import itertools
import os
import re
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.recording.log import open_log
from hapticd.testing.terminal import CTRL_C, HAPTICD, PATIENCE_S, Terminal

Start = Callable[..., Terminal]


SESSION = ("--duration", "300", "--log", "session.mcap")
HASTY = Path(__file__).with_name("hasty.py")


@pytest.fixture
def start(open_terminal: Start, tmp_path: Path) -> Start:
    """Runs a machine in a window."""

    def begin(machine: str, **window: object) -> Terminal:
        return open_terminal([*HAPTICD, "run", machine, *SESSION], tmp_path, **window)

    return begin


@pytest.fixture
def start_hasty(open_terminal: Start, tmp_path: Path) -> Start:
    """The same with a machine that engages in a moment."""

    def begin(machine: str, **window: object) -> Terminal:
        command = [sys.executable, str(HASTY), "run", machine, *SESSION]
        return open_terminal(command, tmp_path, **window)

    return begin


def modes(folder: Path) -> list[Mode]:
    return [Mode(int(record.fixed["mode"])) for record in open_log(str(folder / "session.mcap")).records()]


def events(folder: Path) -> list[str]:
    return [event.text for event in open_log(str(folder / "session.mcap")).events()]


def test_a_person_stops_resets_presses_pushes_and_quits_by_single_keys(
    start: Start, machine: str, tmp_path: Path
) -> None:
    terminal = start(machine)
    terminal.until_seen("Keys, without Enter:")
    terminal.until_stays("ENGAGING")
    assert terminal.single_keys
    terminal.until_stays("dead-man pressed")
    terminal.until_stays("s stop")
    terminal.type("x")
    terminal.until_seen('"x": no such key; s stop')
    terminal.type("s")
    terminal.until_seen("R3 operator")
    terminal.until_stays("STOPPED")
    terminal.until_stays("next: l let go")  # what the screen says is what works
    terminal.type("r")
    terminal.until_seen("reset refused: release the dead-man switch first")
    terminal.type("l")
    terminal.until_seen("the simulated person is yours now")
    terminal.until_stays("next: r reset")
    terminal.type("r")
    terminal.until_seen("READY: reset")
    terminal.until_stays("next: p press")
    terminal.type("p")
    terminal.until_seen("ENABLING: dead-man pressed", times=2)
    terminal.until_stays("ACTIVE")
    for _ in range(8):
        terminal.type("\x1b[D")
        terminal.look(0.05)
    pushed = time.monotonic()
    while time.monotonic() < pushed + 1.0:
        terminal.look()
    terminal.type("q")
    assert terminal.end().status == 0, terminal.emulator.text
    assert terminal.modes == terminal.before
    assert "ticks at 1000 Hz" in terminal.emulator.text
    # a busy host may make any callback of the daemon late, and the daemon says which
    lost = [event for event in events(tmp_path) if "recorder" in event and "recorder_link.py" not in event]
    assert lost == []
    verify = [sys.executable, "-m", "hapticd.runtime", "replay", "session.mcap", "--verify"]
    assert subprocess.run(verify, capture_output=True, check=False, cwd=tmp_path).returncode == 0


def test_a_push_moves_the_handle_the_way_it_says(start_hasty: Start, machine: str, tmp_path: Path) -> None:
    terminal = start_hasty(machine)
    terminal.until_stays("ACTIVE")
    terminal.type("u")  # takes the hand from the script: it stays where it is
    terminal.until_seen("the simulated person is yours now")
    for _ in range(6):
        terminal.type("\x1b[B")  # back: along -y, away from the wall of the one machine
        terminal.look(0.1)
    settle = time.monotonic() + 1.5
    while time.monotonic() < settle:
        terminal.look()
    terminal.type("q")
    assert terminal.end().status == 0
    records = [r.fixed for r in open_log(str(tmp_path / "session.mcap")).records()]
    active = [r for r in records if r["mode"] == Mode.ACTIVE]
    name = "twin_position" if machine == "giant" else "position"
    y = [r["state"][name][1] + (r["state"]["ppu"][0][1] if machine == "giant" else 0.0) for r in active]
    assert y[-1] < y[0] - 0.005
    force = "wrench" if machine == "giant" else "hand"
    assert max(np.linalg.norm(r["state"][force][:3]) for r in active) < 60.0


STAYING_LINE = re.compile(r"\r([^\r\n\x1b]*)\x1b\[K")


def check_fit(written: str, columns: int) -> None:
    lines = STAYING_LINE.findall(written)
    assert lines and all(len(line) < columns for line in lines)
    live = [line for line in lines if "ACTIVE" in line]
    assert live
    assert any(len(line) > 40 for line in lines) == (columns > 40)
    if columns >= 80:
        assert any("force" in line for line in live)


def test_the_lines_that_stay_fit_the_window_and_follow_it_as_it_grows_and_shrinks(
    start_hasty: Start, machine: str
) -> None:
    terminal = start_hasty(machine, columns=40)
    terminal.until_stays("ACTIVE")
    check_fit(terminal.raw, 40)
    for columns in (80, 200, 40, 120):
        terminal.resize(columns, 24)
        terminal.look()
        resized = len(terminal.raw)
        terminal.until(lambda at=resized: terminal.raw[at:].count(" ACTIVE") > 3, "four more lines")  # type: ignore[misc]
        *_, begin = itertools.islice(STAYING_LINE.finditer(terminal.raw, resized), 3)  # two were under way
        check_fit(terminal.raw[begin.start() :], columns)
    terminal.type("q")
    assert terminal.end().status == 0
    check_fit(terminal.raw[begin.start() :], columns)


def test_nothing_is_shown_as_measured_before_it_is(start: Start, machine: str) -> None:
    terminal = start(machine)
    terminal.until_seen("READY: all devices answer")
    early = [line for line in STAYING_LINE.findall(terminal.raw) if "BRINGUP" in line]
    assert not any(word in line for line in early for word in ("force", "dead-man", " at "))
    terminal.type("q")
    assert terminal.end().status == 0


def test_control_c_ends_with_a_summary_and_the_terminal_as_it_was(
    start: Start, machine: str, tmp_path: Path
) -> None:
    terminal = start(machine)
    terminal.until_stays("ENGAGING")
    terminal.type(CTRL_C)
    assert terminal.end().status == 0
    assert "ticks at 1000 Hz" in terminal.emulator.text
    assert "^C" not in terminal.emulator.text
    assert os.get_blocking(terminal.slave)  # the shell shares this
    assert terminal.modes == terminal.before
    assert modes(tmp_path)[-1] is Mode.STOPPED


def test_events_and_lines_do_not_garble_each_other(start: Start) -> None:
    terminal = start("giant")
    terminal.until_stays("ENGAGING")
    for times in range(1, 6):
        terminal.type("xh")
        terminal.until_seen('"x": no such key', times)
        terminal.until_seen("Keys, without Enter:", times + 1)
    terminal.type("q")
    assert terminal.end().status == 0
    text = terminal.emulator.text
    assert text.count("Keys, without Enter:") == 6
    assert text.count('"x": no such key') == 5
    for line in text.splitlines():
        assert "late" not in line or "no such key" not in line
    head = text[: text.index("ticks at 1000 Hz")]
    assert " us (p99)" not in head  # of the lines that stay, nothing is left behind


def test_a_terminal_that_hangs_holds_nothing_up(start: Start, machine: str, tmp_path: Path) -> None:
    terminal = start(machine, stdout=subprocess.DEVNULL)
    terminal.until_stays("ENGAGING")
    terminal.type("\x13")  # Ctrl-S
    time.sleep(3.0)
    terminal.type("x" * 20 + "s")
    time.sleep(2.0)
    terminal.type("q")
    time.sleep(2.0)
    terminal.type("\x11")  # Ctrl-Q
    assert terminal.end().status == 3  # the stop was not reset
    assert modes(tmp_path)[-1] is Mode.STOPPED
    assert "typed: quit" in events(tmp_path)
    log = open_log(str(tmp_path / "session.mcap"))
    ticks = [int(record.fixed["tick"]) for record in log.records()]
    assert ticks[-1] > 3000
    assert (
        max(later - tick for tick, later in itertools.pairwise(ticks)) < 1000
    )  # it hung for seven times as long


def test_a_window_that_closes_brings_the_machine_to_rest(start: Start, machine: str, tmp_path: Path) -> None:
    terminal = start(machine)
    terminal.until_stays("ENGAGING")
    terminal.close_window()
    terminal.process.wait(PATIENCE_S)
    assert modes(tmp_path)[-1] is Mode.STOPPED
    assert any("end at tick" in event for event in events(tmp_path))


SHELL = 'set -m; "$@"; read -r line; fg > /dev/null'
"""Job control, as of a person at a prompt: the program, then Enter, and it goes on in the foreground."""


def test_a_suspended_session_stops_first_and_gives_the_terminal_back(
    open_terminal: Start, machine: str, tmp_path: Path
) -> None:
    terminal = open_terminal(["bash", "-c", SHELL, "bash", *HAPTICD, "run", machine, *SESSION], tmp_path)
    terminal.until_stays("ENGAGING")
    pid = terminal.child("hapticd")
    terminal.type("\x1a")
    terminal.until(lambda: state(pid) == "T", "suspended")
    time.sleep(0.5)
    terminal.look(0.3)
    assert terminal.modes == terminal.before
    assert "us (p99)" not in "".join(terminal.staying)  # the shell's prompt comes here
    terminal.type("\n")
    terminal.until_stays("STOPPED")
    terminal.until(lambda: terminal.single_keys, "single keys again")
    terminal.type("q")
    assert terminal.end().status == 3  # stopped, and not reset
    assert terminal.modes == terminal.before
    records = [record.fixed for record in open_log(str(tmp_path / "session.mcap")).records()]
    gap = int(np.argmax([int(record["skipped"]) for record in records]))
    assert Mode(int(records[gap - 1]["mode"])) is Mode.STOPPED  # at rest before nobody controls it


@pytest.mark.parametrize("around", [[], ["sh", "-c", '"$@"; exit $?', "sh"]])
def test_where_nobody_could_resume_a_session_ctrl_z_stops_the_machine_alone(
    open_terminal: Start, tmp_path: Path, around: list[str]
) -> None:
    terminal = open_terminal([*around, sys.executable, str(HASTY), "run", "giant", *SESSION], tmp_path)
    terminal.until_stays("ACTIVE")
    terminal.type("\x1a")
    terminal.until_seen("no shell could resume")
    terminal.until_stays("STOPPED")
    terminal.type("q")  # it still listens
    assert terminal.end().status == 3
    assert terminal.modes == terminal.before


def state(pid: int) -> str:
    return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]


@pytest.mark.parametrize("victim", ["recorder", "plant_process"])
def test_the_terminal_is_as_it_was_after_a_child_died(start: Start, machine: str, victim: str) -> None:
    terminal = start(machine)
    terminal.until_stays("ENGAGING")
    os.kill(terminal.child(victim), signal.SIGKILL)
    if victim == "recorder":
        terminal.until_seen("the recorder died: this session is not recorded any more")
        terminal.type("q")
    assert terminal.end().status in (1, 3)
    assert terminal.modes == terminal.before


def test_the_recorder_gives_the_terminal_back_when_the_daemon_is_killed(start: Start) -> None:
    terminal = start("giant")
    terminal.until_stays("ENGAGING")
    recorder = terminal.child("recorder")
    terminal.process.send_signal(signal.SIGKILL)
    terminal.process.wait()
    deadline = time.monotonic() + PATIENCE_S
    while Path(f"/proc/{recorder}").exists() and time.monotonic() < deadline:
        terminal.look()
    assert "its log is complete" in " ".join(terminal.emulator.text.split())
    try:
        assert terminal.modes == terminal.before
    except termios.error:  # the session of a terminal may go with its leader
        pass


@pytest.mark.parametrize("language", ["C", "POSIX", "en_US.ISO-8859-1"])
def test_a_terminal_that_cannot_be_steered_gets_plain_lines_and_gives_words(
    start: Start, machine: str, tmp_path: Path, language: str
) -> None:
    terminal = start(machine, variables={"TERM": "dumb", "LC_ALL": language, "LANG": language})
    terminal.until_seen("Type a word and Enter:")
    terminal.until_seen("ENGAGING: drives enabled")
    assert not terminal.single_keys
    terminal.type("abort\n")
    terminal.until_seen('"abort": no such word; stop, quit, help')
    terminal.type("release\n")
    terminal.until_seen("R3 dead_man")
    terminal.until_seen("STOPPED: drives switch off")
    terminal.type("  Reset \n")
    terminal.until_seen("READY: reset")
    terminal.type("press\n")
    terminal.until_seen("ENABLING: dead-man pressed", times=2)
    terminal.type("quit\n")
    assert terminal.end().status == 0
    assert "\x1b" not in terminal.raw


def test_a_reader_of_the_messages_that_leaves_does_not_end_the_recording(
    machine: str, tmp_path: Path
) -> None:
    read, write = os.pipe()
    command = [sys.executable, "-m", "hapticd.runtime", "run", machine, "--duration", "1.5"]
    process = subprocess.Popen(
        [*command, "--log", "session.mcap"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=write,
        cwd=tmp_path,
    )
    os.close(write)
    os.read(read, 1)
    os.close(read)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert b"ticks at 1000 Hz" in output
    assert modes(tmp_path)[-1] is Mode.STOPPED


@pytest.mark.parametrize("machine", ["giant", "rhi"])
def test_in_lockstep_control_c_ends_with_a_summary(
    open_terminal: Start, machine: str, tmp_path: Path
) -> None:
    terminal = open_terminal([*HAPTICD, "run", machine, "--lockstep", *SESSION], tmp_path)
    terminal.until_seen("ENGAGING")
    terminal.type(CTRL_C)
    assert terminal.end().status == 0, terminal.emulator.text
    assert "ticks at 1000 Hz" in terminal.emulator.text
    assert modes(tmp_path)[-1] is Mode.STOPPED
