"""Sentences fit a terminal, and stay whole in a pipe."""

from __future__ import annotations

import io
import os
import pty
from pathlib import Path

import pytest
from hapticd.runtime.command_line.paragraphs import rows, tell
from hapticd.testing.terminal import HAPTICD, Terminal

LONG = "a sentence of words that a dead-man switch and /a/path/that/is/as/long/as/thirty/characters hold " * 3
COLUMNS = 80


def shown(columns: int, text: str) -> list[str]:
    """On a terminal of so many columns."""
    import fcntl
    import struct
    import termios

    master, slave = pty.openpty()
    fcntl.ioctl(master, termios.TIOCSWINSZ, struct.pack("4H", 24, columns, 0, 0))
    with open(slave, "w") as stream:
        found = rows(text, stream)
    os.close(master)
    return found


@pytest.mark.parametrize("columns", [50, 80, 117])
def test_rows_end_before_the_last_column_and_lose_no_word(columns: int) -> None:
    found = shown(columns, LONG)
    assert len(found) > 1 and all(len(row) < columns for row in found)
    assert " ".join(found).split() == LONG.split()


def test_a_pipe_gets_one_line() -> None:
    assert rows(LONG, io.StringIO()) == [LONG]
    heard = io.StringIO()
    tell("one\ntwo", heard)
    assert heard.getvalue() == "one\ntwo\n"


def test_a_word_that_does_not_fit_stays_whole() -> None:
    assert "x" * 90 in [row.strip() for row in shown(40, f"see {'x' * 90} there")]


HANDS = ("hands", "rhi", "--count", "1", "--seconds", "3.5", "--workers", "1")
SUMMARIES = {
    "run": ("run", "rhi", "--lockstep", "--duration", "1", "--log", "x.mcap"),
    "hands": HANDS,
    "identify": ("identify", "panda", "--seconds", "12"),
    "check": ("check", "panda"),
}
COMMANDS = ("replay: ", "the worst again: ", "log: ")
"""What these lines hold is copied from the screen, and no row of it may be a line of its own."""


@pytest.mark.parametrize("summary", SUMMARIES)
def test_summaries_fit_a_terminal_of_80_columns(summary: str, tmp_path: Path) -> None:
    terminal = Terminal([*HAPTICD, *SUMMARIES[summary]], tmp_path, columns=COLUMNS, height=100)
    try:
        terminal.end()
    finally:
        terminal.dispose()
    rows_shown = [row for row in terminal.emulator.text.splitlines() if row]
    assert rows_shown and not terminal.emulator.history
    assert [row for row in rows_shown if len(row) >= COLUMNS and not row.startswith(COMMANDS)] == []
