"""Keys of a small lab, and both ends of a session without a network between them."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import pytest
from hapticd.link.channel import TO_AVATAR, TO_OPERATOR, Channel, SessionKeys
from hapticd.link.keygen import keygen
from hapticd.link.stations import Role, Station
from hapticd.link.terms import Terms

OPERATOR = Terms(sends=40, receives=24, oldest=0.05)
AVATAR = Terms(sends=24, receives=40, oldest=0.05)
"""Terms of the two ends: payloads of some bytes, a declared delay of 50 ms."""


@pytest.fixture(scope="session")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders of keys: those of the lab by their names, those of strangers in a folder of their own."""
    folder = tmp_path_factory.mktemp("lab") / "keys"
    keygen(
        folder,
        [
            Station("robot", Role.AVATAR),
            Station("alice", Role.OPERATOR),
            Station("bob", Role.OPERATOR),
            Station("mike", Role.MAINTAINER),
            Station("olga", Role.OBSERVER),
        ],
    )
    now = datetime.now(UTC)
    keygen(folder, [Station("late", Role.OPERATOR)], days=1, now=now - timedelta(days=10))
    keygen(folder, [Station("early", Role.OPERATOR)], days=9, now=now + timedelta(days=3))
    keygen(folder, [Station("old-robot", Role.AVATAR)], days=1, now=now - timedelta(days=10))
    keygen(folder / "strangers", [Station("alice", Role.OPERATOR), Station("robot", Role.AVATAR)])
    return folder


class Ticker:
    """A clock that shows what it is told to [ns]."""

    def __init__(self, now: int = 1_000_000_000) -> None:
        self.now = now

    def __call__(self) -> int:
        return self.now

    def wait(self, seconds: float) -> None:
        self.now += round(seconds * 1e9)


class Pair(NamedTuple):
    """Both ends of a session; packets wait between them until they are received."""

    operator: Channel
    avatar: Channel
    time: Ticker

    def exchange(self, times: int = 1) -> None:
        """Both send and receive, a millisecond apart."""
        for _ in range(times):
            self.operator.send(bytes(40))
            self.avatar.receive()
            self.avatar.send(bytes(24))
            self.operator.receive()
            self.time.wait(1e-3)


def until(true: Callable[[], bool]) -> None:
    """Wait for what a thread does."""
    for _ in range(6000):
        if true():
            return
        time.sleep(0.01)
    raise AssertionError("it did not happen")


KEYS = SessionKeys(0x1122334455667788, bytes(range(32)), bytes(range(32, 64)))


@pytest.fixture
def pair() -> Iterator[Pair]:
    """A session that has begun, with 1 ms a packet."""
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    time = Ticker()
    made = Pair(
        Channel(left, KEYS, TO_AVATAR, OPERATOR, time), Channel(right, KEYS, TO_OPERATOR, AVATAR, time), time
    )
    made.exchange(3)
    yield made
    made.operator.close()
    made.avatar.close()


Wire = Callable[[], bytes]


@pytest.fixture
def wire() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Two connected datagram sockets."""
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    yield left, right
    left.close()
    right.close()
