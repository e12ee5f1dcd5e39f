"""The machine live, in wall time, on a pseudo-terminal: what a person sees, types and gets back."""

from __future__ import annotations

import os
import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ...runtime.core.modes import Mode
from ...runtime.recording.log import open_log
from ..cases import load
from ..terminal import CTRL_C, HAPTICD, Terminal

pytestmark = pytest.mark.live

LIVE_LINE = re.compile(r"\r([^\r\n\x1b]*)\x1b\[K")
Start = Callable[..., Terminal]


@pytest.fixture
def start(machine_name: str, tmp_path: Path) -> Iterator[Start]:
    """Runs the machine in a window of its own."""
    windows: list[Terminal] = []
    name = os.path.abspath(machine_name) if machine_name.endswith(".toml") else machine_name

    def begin(**window: object) -> Terminal:
        command = [*HAPTICD, "run", name, "--duration", "300", "--log", "session.mcap"]
        windows.append(Terminal(command, tmp_path, **window))
        return windows[-1]

    yield begin
    for window in windows:
        window.dispose()


def engage(terminal: Terminal, machine_name: str) -> None:
    """The drives are on: by the script, or by keys."""
    loaded = load(machine_name)
    simulation = loaded.config.simulation
    assert simulation is not None
    scripted = any(press.pressed for press in simulation.hand.dead_man)
    if not (scripted and loaded.config.arming.by == "dead-man"):
        terminal.until_stays("READY")
        terminal.type("l+p" if loaded.config.arming.by == "command" else "lp")
    terminal.until_seen("ENGAGING: drives enabled")


def modes(folder: Path) -> list[Mode]:
    """Mode of every recorded tick."""
    return [Mode(int(record.fixed["mode"])) for record in open_log(str(folder / "session.mcap")).records()]


def test_a_person_stops_resets_presses_pushes_and_quits_by_keys_and_it_replays(
    start: Start, machine_name: str, tmp_path: Path
) -> None:
    terminal = start()
    terminal.until_seen("Keys, without Enter:")
    engage(terminal, machine_name)
    assert terminal.single_keys
    terminal.type("s")
    terminal.until_seen("R3 operator")
    terminal.until_stays("STOPPED")
    terminal.type("r")
    terminal.until_seen("reset refused: release the dead-man switch first")
    terminal.type("l")
    terminal.until_stays("next: r reset")
    terminal.type("r")
    terminal.until_seen("READY: reset")
    if load(machine_name).config.arming.by == "command":
        terminal.type("+")
    terminal.type("p")
    terminal.until_stays("ACTIVE")
    for key in ("\x1b[D", "\x1b[C", "\x1b[A", "\x1b[B"):
        terminal.type(key)
        terminal.look(0.1)
    terminal.type("q")
    assert terminal.end().status == 0, terminal.emulator.text
    assert terminal.modes == terminal.before
    assert terminal.survivors() == []
    assert modes(tmp_path)[-1] is Mode.STOPPED
    verify = [*HAPTICD, "replay", "session.mcap", "--verify"]
    done = subprocess.run(verify, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_control_c_brings_it_to_rest_with_a_summary_and_the_terminal_as_it_was(
    start: Start, machine_name: str, tmp_path: Path
) -> None:
    terminal = start()
    engage(terminal, machine_name)
    terminal.type(CTRL_C)
    ended = terminal.end()
    assert ended.status == 0, terminal.emulator.text
    assert "Traceback" not in ended.said
    assert f"ticks at {load(machine_name).config.loop.rate:g} Hz" in terminal.emulator.text
    assert terminal.modes == terminal.before
    assert terminal.survivors() == []
    assert modes(tmp_path)[-1] is Mode.STOPPED


@pytest.mark.parametrize("columns", [40, 80])
def test_the_live_line_and_the_verdict_fit_the_window(start: Start, machine_name: str, columns: int) -> None:
    terminal = start(columns=columns)
    engage(terminal, machine_name)
    drives_on = re.compile("ENGAGING|ACTIVE")
    terminal.until(lambda: any(map(drives_on.search, LIVE_LINE.findall(terminal.raw))), "drives on")
    terminal.type("q")
    assert terminal.end().status == 0
    lines = LIVE_LINE.findall(terminal.raw)
    assert len(lines) > 3 and all(len(line) < columns for line in lines)
    _, verdict = terminal.raw.replace("\r\n", "\n").split("\nverdict: ")
    assert all(len(row) < columns for row in f"verdict: {verdict}".split("\n"))


def test_a_recorder_that_dies_ends_nothing_but_the_recording(start: Start, machine_name: str) -> None:
    terminal = start()
    engage(terminal, machine_name)
    os.kill(terminal.child("recorder"), signal.SIGKILL)
    terminal.until_seen("the recorder died: this session is not recorded any more")
    terminal.type("q")
    assert terminal.end().status in (1, 3)
    assert terminal.modes == terminal.before


def test_without_its_plant_a_session_ends_and_says_so(start: Start, machine_name: str) -> None:
    terminal = start()
    engage(terminal, machine_name)
    os.kill(terminal.child("plant_process"), signal.SIGKILL)
    assert terminal.end().status in (1, 3)
    assert terminal.modes == terminal.before
    assert terminal.survivors() == []
