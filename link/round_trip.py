"""Round trips over the link and over plain UDP, in turns, to another process of this host."""

from __future__ import annotations

import select
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from time import perf_counter_ns, sleep
from typing import NamedTuple, Protocol

import numpy as np

from .caller import Caller
from .credentials import load
from .echo import LOOPBACK, terms
from .errors import LinkError
from .keygen import keygen
from .stations import Role, Station

MOST_FORGED = 255
"""Forged packets that can follow each answer."""
PATIENCE_MS = 50
"""A packet that has not come back by then is lost."""
NUMBER = 8
"""Bytes of the number that each payload begins with."""


class Way(Protocol):
    """What packets go over."""

    def fileno(self) -> int:
        """To wait for packets."""

    def send(self, payload: bytes) -> object:
        """Send one."""

    def take(self) -> bytes:
        """One that has come; b"" where there is none."""

    @property
    def forged(self) -> int:
        """How many forged packets follow each answer."""


class Plain(socket.socket):
    """UDP and nothing else."""

    forged = 0

    def take(self) -> bytes:
        """A datagram that has come."""
        return self.recv(2048)


class Sealed:
    """The link."""

    def __init__(self, end: Caller, forged: int = 0) -> None:
        self.fileno, self.send, self._end, self.forged = end.fileno, end.send, end, forged

    def take(self) -> bytes:
        """The newest packet that has come."""
        received = self._end.receive()
        return received.payload if received else b""


class Trips(NamedTuple):
    """Round trips of one way.

    Attributes:
        sent, lost: packets.
        p50, p99, p999, longest: of the round trips [s].
        late: 99.9th percentile of how much later than it should a packet's turn began [s].
    """

    sent: int
    lost: int
    p50: float
    p99: float
    p999: float
    longest: float
    late: float


class Comparison(NamedTuple):
    """All ways.

    Attributes:
        plain, link: without an attack.
        flooded: the link among forged packets, None where none were asked for.
        refused: how many of those were dropped; accepted: how many packets were not dropped.
        handshake: how long it took [s].
    """

    plain: Trips
    link: Trips
    flooded: Trips | None
    refused: int
    accepted: int
    handshake: float


def compare(
    size: int,
    rate: float,
    packets: int,
    rounds: int,
    forged: int = 0,
    show: Callable[[int], object] = lambda _: None,
) -> Comparison:
    """Measure all ways in turns.

    Args:
        size: of a payload [bytes], more than NUMBER.
        rate: of the packets [Hz].
        packets: of a way in a round.
        rounds: how many.
        forged: packets that follow each answer, on a third way; 0: there is no such way.
        show: is told after each round how many are done.

    Raises:
        LinkError: the other process does not answer.
    """
    with _echo(size) as (folder, ports), Plain(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        plain.connect((LOOPBACK, ports[1]))
        begin = perf_counter_ns()
        with closing(Caller(load(folder), terms(size), LOOPBACK, ports[0], "echo")) as caller:
            caller.wait(5.0)
            handshake = (perf_counter_ns() - begin) * 1e-9
            ways: list[tuple[Way, list[tuple[int, int]]]] = [(plain, []), (Sealed(caller), [])]
            if forged:
                ways.append((Sealed(caller, forged), []))
            for way, _ in ways:  # what is done once is not part of it
                _trips(way, size, rate, 20)
            for done in range(rounds):
                for way, found in ways if done % 2 else reversed(ways):
                    found += _trips(way, size, rate, packets)
                show(done + 1)
            counts = caller.counts()
    tables = [_table(found, packets * rounds) for _, found in ways]
    flooded = tables[2] if forged else None
    return Comparison(tables[0], tables[1], flooded, counts.refused, counts.received, handshake)


@contextmanager
def _echo(size: int) -> Iterator[tuple[Path, tuple[int, int]]]:
    """Another process that echoes: our folder of keys, and its ports."""
    with tempfile.TemporaryDirectory(prefix="hapticd-link-") as temporary:
        stations = [Station("echo", Role.AVATAR), Station("probe", Role.OPERATOR)]
        theirs, ours = keygen(Path(temporary) / "keys", stations, days=1)
        command = [sys.executable, "-m", "hapticd.link.echo", str(theirs), str(size)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None and child.stdin is not None
            words = child.stdout.readline().split()
            if len(words) != 2:
                raise LinkError("the process at the other end did not start; its message is above")
            yield ours, (int(words[0]), int(words[1]))
            child.stdin.close()


def _trips(way: Way, size: int, rate: float, packets: int) -> list[tuple[int, int]]:
    """Round trips of packets that came back, and how late they began [ns]."""
    poll = select.poll()
    poll.register(way.fileno(), select.POLLIN)
    period, found = round(1e9 / rate), []
    due = perf_counter_ns()
    for number in range(packets):
        payload = number.to_bytes(NUMBER, "little").ljust(size - 1, b"\0") + bytes([way.forged])
        if (early := due - perf_counter_ns()) > 0:
            sleep(early * 1e-9)
        begin = perf_counter_ns()
        way.send(payload)
        while poll.poll(PATIENCE_MS):
            if way.take() == payload:
                found.append((perf_counter_ns() - begin, begin - due))
                break
        due = max(due + period, begin)
    return found


def _table(found: list[tuple[int, int]], sent: int) -> Trips:
    if not found:
        raise LinkError("not one packet came back")
    trips, late = np.array(found).T * 1e-9
    p50, p99, p999, longest = map(float, np.percentile(trips, [50.0, 99.0, 99.9, 100.0]))
    return Trips(sent, sent - len(found), p50, p99, p999, longest, float(np.percentile(late, 99.9)))
