"""A person takes the simulated hand from the script and keeps it past the script's end."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from hapticd.testing.terminal import HAPTICD, Terminal


def test_a_session_goes_on_past_its_planned_end_until_the_person_quits(
    write_config: Callable[..., Path], open_terminal: Callable[..., Terminal], tmp_path: Path
) -> None:
    config = write_config(('duration = "30 s"', 'duration = "3 s"'))
    command = [*HAPTICD, "run", str(config), "--log", "session.mcap"]
    terminal = open_terminal(command, tmp_path, columns=120)
    terminal.until_stays("/3 s ENGAGING")
    terminal.type("u")
    terminal.until_seen("the session goes on until you quit")
    terminal.until(lambda: seconds(terminal) > 3.5, "past its end, which does not stand there any more")
    terminal.type("q")
    assert terminal.end().status == 0, terminal.emulator.text
    assert "verdict: a person led the hand, no limit passed" in terminal.emulator.text


def seconds(terminal: Terminal) -> float:
    """Seconds of the session, as the live line has them where no end stands beside them; else 0."""
    found = re.match(r" *(\d+\.\d) s [A-Z]", terminal.staying[0])
    return float(found[1]) if found else 0.0
