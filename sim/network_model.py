"""A network between two stations in virtual time: delay, jitter, loss in bursts, reordering, outages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np

from ..link.port import Received

Packet = tuple[float, int, float, bytes]
"""When it arrives [s], its number, when it set out [s], what it holds."""
AHEAD = 1024
"""Packets for which a direction draws at once."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """Of each direction of a network.

    Attributes:
        delay: mean [s].
        jitter: largest deviation from it; each packet's own, uniform, so that packets overtake others [s].
        loss: share of the packets that are lost, 0 to less than 1.
        burst: mean number of packets that are lost in a row, 1 or more (Gilbert's two states).
        outages: from when to when nothing comes through [s].
    """

    delay: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    burst: float = 1.0
    outages: Sequence[tuple[float, float]] = ()

    def __post_init__(self) -> None:
        if not (0.0 <= self.jitter <= self.delay):
            raise ValueError(f"jitter {self.jitter} s is not within 0 and the delay of {self.delay} s")
        if not (0.0 <= self.loss < 1.0 and self.burst >= 1.0):
            raise ValueError(f"loss {self.loss} is no share below 1, or burst {self.burst} is below 1")

    @property
    def longest(self) -> float:
        """Of all delays [s]."""
        return self.delay + self.jitter


class Direction:
    """Packets one way."""

    def __init__(self, conditions: Conditions, random: np.random.Generator) -> None:
        self._conditions, self._random = conditions, random
        self._under_way: list[Packet] = []
        self._draws: list[list[float]] = []
        self._sent, self._newest, self._losing = 0, -1, False
        self.lost = self.overtaken = 0

    def send(self, payload: bytes, now: float) -> Packet | None:
        """A packet sets out; None where it is lost."""
        c = self._conditions
        if not self._draws:
            self._draws = self._random.random((AHEAD, 2)).tolist()
        chance, deviation = self._draws.pop()
        self._sent += 1
        # of Gilbert's states the bad one loses every packet: it is left at 1 / burst, and entered so often
        # that the share of its packets is the loss
        leave = 1.0 / c.burst
        enter = leave * c.loss / (1.0 - c.loss)
        self._losing = chance >= leave if self._losing else chance < enter
        if self._losing or any(begin <= now < end for begin, end in c.outages):
            self.lost += 1
            return None
        return now + c.delay + c.jitter * (2.0 * deviation - 1.0), self._sent, now, payload

    def carry(self, packet: Packet) -> None:
        """One that set out is on its way."""
        heappush(self._under_way, packet)

    def receive(self, now: float) -> Received | None:
        """The newest that has arrived and is newer than all before."""
        found: Received | None = None
        while self._under_way and self._under_way[0][0] <= now + 1e-9:
            _, number, sent, payload = heappop(self._under_way)
            if number > self._newest:
                self._newest, found = number, Received(payload, now - sent)
            else:
                self.overtaken += 1
        return found


class ModelPort:
    """One end of it; see ``hapticd.link.port.Port``."""

    def __init__(self, network: NetworkModel, out: Direction, back: Direction) -> None:
        self._network, self._out, self._back = network, out, back

    def send(self, payload: bytes) -> None:
        """Now."""
        if packet := self._out.send(payload, self._network.time):
            self._out.carry(packet)

    def receive(self) -> Received | None:
        """What has arrived by now."""
        return self._back.receive(self._network.time)


class NetworkModel:
    """Both directions, and their time.

    Attributes:
        time: virtual [s].
        there, back: the directions.
        ports: the two ends.
    """

    def __init__(self, conditions: Conditions, seed: int, back: Conditions | None = None) -> None:
        """``back`` where the second direction is another."""
        self.time = 0.0
        self.there, self.back = (
            Direction(each, np.random.default_rng([seed, i]))
            for i, each in enumerate((conditions, back or conditions))
        )
        self.ports = ModelPort(self, self.there, self.back), ModelPort(self, self.back, self.there)

    def advance(self, dt: float) -> None:
        """Let dt [s] pass."""
        self.time += dt
