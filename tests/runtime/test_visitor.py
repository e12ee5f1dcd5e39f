"""A person at a view: the same orders as at the keyboard, a dead-man switch that opens in silence."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hapticd.runtime.core.sections import PythonCanBus
from hapticd.runtime.live.orders import PRESS, PULL_OUT, RELEASE, RESET, STOP, STRIKE, Order, viewed
from hapticd.runtime.live.visitor import AT_ONCE, SILENCE_S, Visitor
from hapticd.sim.person import Deed, Lead

from .conftest import loaded


class Loop:
    """Readers and timers that a test runs by hand."""

    def __init__(self) -> None:
        self.readers: dict[int, Callable[[], None]] = {}
        self.timers: list[Any] = []

    def add_reader(self, fd: int, callback: Callable[..., None], *args: Any) -> None:
        self.readers[fd] = lambda: callback(*args)

    def remove_reader(self, fd: int) -> None:
        self.readers.pop(fd, None)

    def call_later(self, delay: float, callback: Callable[..., None], *args: Any) -> Any:
        timer = type("Timer", (), {"delay": delay, "cancelled": False})()
        timer.cancel = lambda: setattr(timer, "cancelled", True)
        timer.run = lambda: callback(*args)
        self.timers.append(timer)
        return timer

    def due(self, delay: float) -> None:
        """Let the timers of a length that were not cancelled run out."""
        ready = [t for t in self.timers if t.delay == delay and not t.cancelled]
        self.timers = [t for t in self.timers if t not in ready]
        for timer in ready:
            timer.run()


class Told:
    """A console that notes."""

    def __init__(self) -> None:
        self.heard: list[Order | Lead] = []

    def obey(self, order: Order) -> None:
        self.heard.append(order)

    def act(self, deed: Deed | Lead) -> None:
        assert isinstance(deed, Lead)
        self.heard.append(deed)


class Room:
    """A visitor, and the page that talks to it."""

    def __init__(self, orders: tuple[Order, ...], path: Path) -> None:
        self.console, self.loop = Told(), Loop()
        self.visitor = Visitor(self.console, orders)  # type: ignore[arg-type]
        self.visitor.attend(self.loop, path)  # type: ignore[arg-type]
        self.page = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self.path = path

    def say(self, *words: str | bytes) -> list[Order | Lead]:
        for word in words:
            self.page.sendto(word if isinstance(word, bytes) else word.encode(), str(self.path))
        self.breathe()
        said, self.console.heard = self.console.heard, []
        return said

    def breathe(self) -> None:
        for reader in list(self.loop.readers.values()):
            reader()
        for timer in [t for t in self.loop.timers if t.delay < SILENCE_S and not t.cancelled]:
            self.loop.timers.remove(timer)
            timer.run()


@pytest.fixture
def room(tmp_path: Path) -> Iterator[Room]:
    room = Room(viewed(loaded().config), tmp_path / "orders")
    yield room
    room.visitor.leave(room.loop)  # type: ignore[arg-type]
    room.page.close()
    assert not room.path.exists()
    assert not room.loop.readers


def test_words_are_the_orders_of_the_keyboard(room: Room) -> None:
    assert room.say("stop", "reset", "e-stop") == [STOP, RESET, STRIKE]
    assert room.say("pull out") == [PULL_OUT]
    assert room.say("quit", "help", "", "stop ", b"\xff\xfe", "STOP") == []


def test_a_dead_man_switch_is_pressed_once_and_open_after_a_silence(room: Room) -> None:
    assert room.say("hold") == [PRESS]
    for _ in range(5):
        assert room.say("hold") == []
    room.loop.due(SILENCE_S)
    assert room.console.heard == [RELEASE]
    room.console.heard.clear()
    room.loop.due(SILENCE_S)
    assert room.console.heard == []  # once
    assert room.say("hold") == [PRESS]
    assert room.say("release") == [RELEASE]
    room.loop.due(SILENCE_S)
    assert room.console.heard == []  # it was let go already


@pytest.mark.parametrize(("opens", "closes"), [("release", "hold"), ("e-stop", "pull out")])
def test_what_one_page_opens_is_open_for_a_breath_whatever_another_page_says(
    room: Room, opens: str, closes: str
) -> None:
    room.say("hold")
    heard = room.say(opens, closes)
    assert [order.word for order in heard if isinstance(order, Order)] == [opens]
    (closed,) = room.say()
    assert closed in (PRESS, PULL_OUT)


def test_a_place_that_is_none_leads_nowhere(room: Room) -> None:
    assert room.say("lead 1 -2.5 0.25") == [Lead((1.0, -2.5, 0.25))]
    assert room.say("lead 1 2", "lead nan 0 0", "lead 1e9 0 0", "lead a b c") == []


def test_a_flood_takes_a_few_words_a_breath(room: Room) -> None:
    heard = room.say(*["stop"] * (AT_ONCE + 3))
    assert len(heard) == AT_ONCE
    assert len(room.say()) == 3


def test_a_real_machine_can_only_be_stopped(tmp_path: Path) -> None:
    bus = PythonCanBus(interface="virtual", channel="a", bitrate=1e6, data_bitrate=5e6, settings={})  # type: ignore[arg-type]
    real = msgspec.structs.replace(loaded().config, bus=bus)
    assert viewed(real) == (STOP,)
    room = Room(viewed(real), tmp_path / "orders")
    assert room.visitor.words == ["stop"]
    assert room.say("hold", "lead 0 0 0", "press", "reset") == []
    assert room.say("stop") == [STOP]
    room.visitor.leave(room.loop)  # type: ignore[arg-type]
    room.page.close()
