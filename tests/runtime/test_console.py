"""The person at a terminal, heard through a pseudo-terminal by a console whose session only notes."""

from __future__ import annotations

import asyncio
import os
import pty
import signal
import termios
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hapticd.runtime.core.modes import Command, Mode
from hapticd.runtime.live import console as module
from hapticd.runtime.live.console import BREATH_S, Console
from hapticd.runtime.live.daemon import Daemon
from hapticd.runtime.live.keyboard import Keyboard
from hapticd.runtime.live.orders import possible
from hapticd.runtime.live.recorder_link import RecorderLink
from hapticd.sim.person import Deed

from .conftest import loaded


class Noting:
    """A session that notes what it is asked for."""

    now = 0

    def __init__(self) -> None:
        self.asked: list[Command | Deed] = []

    def ask(self, command: Command) -> None:
        self.asked.append(command)

    def lead(self) -> bool:
        return False

    def act(self, deed: Deed) -> None:
        self.asked.append(deed)

    def quit(self) -> None:
        raise AssertionError


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The keyboard's end of the terminal that a console listens to."""
    master, slave = pty.openpty()
    monkeypatch.setattr(module, "STDIN", slave)
    before = signal.getsignal(signal.SIGTTIN)
    yield master
    signal.signal(signal.SIGTTIN, before)
    os.close(master)
    os.close(slave)


def test_a_terminal_that_is_grabbed_twice_comes_back_as_it_was(terminal: int) -> None:
    """SIGCONT comes without a stop before it, too, and after one in which a shell had the terminal."""
    keyboard = Keyboard(module.STDIN, single_keys=True)
    before = termios.tcgetattr(module.STDIN)
    for _ in range(2):
        keyboard.grab()
        assert not termios.tcgetattr(module.STDIN)[3] & termios.ICANON
    keyboard.release()
    assert termios.tcgetattr(module.STDIN) == before
    keyboard.grab()
    shells = [*before[:3], before[3] & ~termios.ECHOE, *before[4:]]
    termios.tcsetattr(module.STDIN, termios.TCSANOW, shells)
    keyboard.grab()
    keyboard.release()
    assert termios.tcgetattr(module.STDIN) == shells


async def test_nothing_is_heard_after_the_end_whatever_was_under_way(terminal: int) -> None:
    session = Noting()
    cycle: Any = SimpleNamespace(mode=Mode.ACTIVE, drives=SimpleNamespace(secured=False))
    recorder: Any = RecorderLink(Path("none.mcap"))
    console = Console(session, cycle, recorder, possible(loaded().config), True, 1000.0)
    loop = asyncio.get_running_loop()
    console.attend(loop)
    try:
        os.write(terminal, b"su")
        while len(session.asked) < 2:
            await asyncio.sleep(0)
        console.leave(loop)  # the next look at the keyboard is planned already
        os.write(terminal, b"s\n")  # the terminal gives lines again
        await asyncio.sleep(5 * BREATH_S)
        assert session.asked == [Command.STOP, Deed.PUSH_UP]
    finally:
        for number in (signal.SIGTSTP, signal.SIGCONT):
            loop.remove_signal_handler(number)


@pytest.mark.parametrize(
    ("duration", "typed", "planned"), [(None, True, None), (5.0, True, 5000), (None, False, 30_000)]
)
def test_who_takes_over_ends_the_session_unless_its_end_was_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, duration: float | None, typed: bool, planned: int | None
) -> None:
    """Through a pipe nobody is there who could."""
    monkeypatch.setattr("hapticd.runtime.live.daemon.typed_at", lambda: typed)
    session = Daemon(loaded(), tmp_path / "session.mcap", duration, live=False)
    assert session.lead() == (planned is None)
    assert session._duration_ticks == planned
