"""The screen: messages scroll, lines stay and fit, nothing is left behind and nothing steers the terminal."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import termios
import tty
from collections.abc import Iterator

import pytest
from hapticd.configs.printable import printable
from hapticd.runtime.live.outlet import CHUNK, MOST_PENDING, Outlet, reopened
from hapticd.runtime.live.screen import FALLBACK, Screen, fit, steerable, terminal_size, width
from hapticd.testing.terminal import Emulator


class Paper:
    """An outlet that keeps what it gets."""

    idle = True

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> None:
        self.text += text


class Window:
    """A screen and the terminal it is on."""

    def __init__(self, columns: int, rows: int, live: bool = True) -> None:
        self.paper, self.size = Paper(), (columns, rows)
        self.screen = Screen(self.paper, live, lambda: self.size)  # type: ignore[arg-type]
        self.emulator = Emulator(columns, rows)

    @property
    def rows(self) -> list[str]:
        self.emulator.feed(self.paper.text.replace("\n", "\r\n"))
        self.paper.text = ""
        return [row.rstrip() for row in self.emulator.rows]


def test_messages_scroll_above_the_lines_that_stay() -> None:
    window = Window(40, 6)
    for k in range(8):
        window.screen.stay([[f"state {k}"], ["keys"]])
        window.screen.message(f"message {k}")
    assert window.rows == [f"message {k}" for k in (4, 5, 6, 7)] + ["state 7", "keys"]
    window.screen.leave()
    assert window.rows[4:] == ["", ""]
    assert window.emulator.wrapped == 0


def test_a_long_message_is_wrapped_between_words() -> None:
    window = Window(40, 8)
    window.screen.stay([["state"]])
    window.screen.message(
        "   12.345 s  STOPPED: torque off, brakes closed; release the dead-man switch and reset"
    )
    rows = window.rows
    assert " ".join(" ".join(rows).split()).startswith("12.345 s STOPPED: torque off, brakes closed; release")
    assert window.emulator.wrapped == 0


def test_a_window_of_few_rows_keeps_the_first_line_only() -> None:
    window = Window(40, 3)
    window.screen.stay([["state"], ["keys"]])
    assert window.rows == ["state", "", ""]


def test_a_screen_that_somebody_else_uses_is_left_as_it_is() -> None:
    window = Window(40, 6)
    window.screen.stay([["state"], ["keys"]])
    window.screen.forget()
    window.paper.text = ""
    window.screen.message("from the background")
    window.screen.leave()
    assert window.paper.text == "from the background\n"


def test_a_plain_screen_gets_messages_alone() -> None:
    window = Window(20, 5, live=False)
    window.screen.stay([["state"], ["keys"]])
    window.screen.message("a message that is longer than a row of the window")
    window.screen.leave()
    assert window.paper.text == "a message that is longer than a row of the window\n"


def test_the_first_word_is_cut_and_others_are_left_out() -> None:
    assert fit(["12.3 s ACTIVE", "force 12 N", "late"], 40) == "12.3 s ACTIVE  force 12 N  late"
    assert fit(["12.3 s ACTIVE", "force 12 N", "late"], 20) == "12.3 s ACTIVE  late"
    assert fit(["12.3 s ACTIVE"], 6) == "12.3 s"
    assert fit(["12.3 s ACTIVE"], 0) == "" and fit([], 10) == ""


def test_wide_and_combining_characters_are_counted_as_terminals_show_them() -> None:
    assert width("モーター") == 8 and width("e\N{COMBINING ACUTE ACCENT}") == 1
    assert fit(["モーター"], 5) == "モー"


def test_a_name_cannot_steer_the_terminal() -> None:
    assert printable("joint\x1b[2J\r\n\x07") == "joint\\x1b[2J\\r\\n\\x07"
    window = Window(60, 6)
    window.screen.stay([["at joint\x1b[2J"]])
    window.screen.message("refused: \x1b]0;title\x07 \u202e")
    assert window.rows[1] == "at joint\\x1b[2J"


def test_only_a_terminal_that_can_move_its_cursor_is_steered(monkeypatch: pytest.MonkeyPatch) -> None:
    master, slave = pty.openpty()
    for name, can in (("xterm", True), ("dumb", False), ("", False)):
        monkeypatch.setenv("TERM", name)
        assert steerable(slave) is can
    read, write = os.pipe()
    monkeypatch.setenv("TERM", "xterm")
    assert not steerable(write)
    assert terminal_size(write) == FALLBACK
    assert terminal_size(slave) == FALLBACK  # it says 0 x 0
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("4H", 30, 100, 0, 0))
    assert terminal_size(slave) == (100, 30)
    for fd in (master, slave, read, write):
        os.close(fd)


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    read, write = os.pipe()
    yield read, write
    for fd in (read, write):
        try:
            os.close(fd)
        except OSError:
            pass


def test_a_full_pipe_does_not_hold_the_writer_up_and_the_loss_is_told(pipe: tuple[int, int]) -> None:
    read, write = pipe
    outlet = Outlet(write)
    line = "x" * 999 + "\n"
    for _ in range(400):
        outlet.write(line)
    assert os.get_blocking(write)  # that of everybody else who writes there is untouched
    text = b""
    while not outlet.idle:
        text += os.read(read, 1 << 20)
        outlet.flush()
    text += os.read(read, 1 << 20)
    lines = text.decode().splitlines()
    assert set(lines[:-1]) == {line[:-1]}
    assert len(lines) - 1 >= MOST_PENDING // 1000
    assert lines[-1] == f"hapticd: {400 - len(lines) + 1} messages did not fit in here; the log has them"


def test_a_terminal_that_is_held_does_not_hold_the_writer_up() -> None:
    master, slave = pty.openpty()
    tty.setraw(slave, termios.TCSANOW)
    termios.tcflow(slave, termios.TCOOFF)
    outlet = Outlet(slave)
    for _ in range(10):
        outlet.write("held\n")
    outlet.close(0.01)
    termios.tcflow(slave, termios.TCOON)
    outlet.close(1.0)
    assert os.read(master, 1000) == b"held\n" * 10
    os.close(master)
    outlet.write("nobody there\n")
    assert outlet.gone
    os.close(slave)


def test_a_reader_that_leaves_is_noticed_and_borne(pipe: tuple[int, int]) -> None:
    read, write = pipe
    outlet = Outlet(write)
    os.close(read)
    outlet.write("hello\n")
    assert outlet.gone
    outlet.write("hello\n")
    outlet.close(1.0)


def test_a_descriptor_that_is_closed_from_the_start_is_borne() -> None:
    read, write = os.pipe()
    os.close(read)
    os.close(write)
    outlet = Outlet(write)
    outlet.write("hello\n")
    assert outlet.gone


def test_a_file_is_appended_to_and_not_opened_anew(tmp_path: object) -> None:
    path = f"{tmp_path}/out.txt"
    with open(path, "w") as stream:
        stream.write("before\n")
        stream.flush()
        outlet = Outlet(stream.fileno())
        outlet.write("x" * 3 * CHUNK + "\n")
        stream.write("after\n")
    with open(path) as stream:
        assert stream.read() == "before\n" + "x" * 3 * CHUNK + "\nafter\n"


def test_what_is_reopened_never_waits(pipe: tuple[int, int]) -> None:
    read, _ = pipe
    own = reopened(read, os.O_RDONLY)
    with pytest.raises(BlockingIOError):
        os.read(own, 1)
    assert os.get_blocking(read)
    os.close(own)
