"""Both stations in lockstep, each in a process of its own: the session of one process in half its time.

What a station sends is heard in the order in which one process lets them take turns (`pair.Pair.tick`): by
the avatar in the same tick, by the operator in the next one. Each waits for that, and for nothing else.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Sequence
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter
from typing import Any

import msgspec

from ...link.port import Received
from ...runtime.configuration.config import Loaded
from ...runtime.live.interrupts import heard, show
from ...runtime.live.lockstep import unswept
from ...runtime.live.outcome import Outcome
from ...runtime.live.recorded import Recorded
from ...sim.network_model import NetworkModel, Packet
from .pair import Pair
from .pair_run import NAMES, over, recorded, teller, ticks

LONGEST_WORD = 1 << 20
"""Of what one station says to the other at once [bytes]."""
LOOK_S = 0.2
"""Between two looks, while the other one says nothing, whether a person has had enough of it [s]."""
LOST = "its process ended before its time; its log has no end, and cannot be replayed"


class Word(msgspec.Struct, frozen=True, array_like=True, tag=True):
    """What a station says to the other one in every tick.

    Attributes:
        packet: that sets out; None: there is none, or it is lost.
        ends: whether it has to end, or ends.
        rests: whether it has come to its end.
        signals: that asked for it.
        told: lines for people.
    """

    packet: Packet | None
    ends: bool
    rests: bool
    signals: Sequence[int]
    told: Sequence[str]


class Farewell(msgspec.Struct, frozen=True, array_like=True, tag=True):
    """What a station says at last: what became of it, and lines for people."""

    outcome: Outcome
    told: Sequence[str]


GONE = Word(None, ends=True, rests=True, signals=(), told=())
"""Of a station that says nothing any more."""
_encode: Callable[[Word | Farewell], bytes] = msgspec.msgpack.Encoder().encode
_decode: Callable[[bytes], Word | Farewell] = msgspec.msgpack.Decoder(Word | Farewell).decode


class Half:
    """A station whose other one is in another process: its session, and the port of its link (``Port``).

    Attributes:
        recorded: the session.
        farewell: of the other station; None before it, and where there was none.
    """

    def __init__(
        self,
        session: Recorded,
        network: NetworkModel,
        first: bool,
        other: socket.socket,
        signals: list[int],
        told: list[str],
    ) -> None:
        """Of one station.

        Args:
            session: of it.
            network: between them; each process has one.
            first: whether it takes its turn before the other one.
            other: where to hear it, and be heard.
            signals: that asked for an end, here or there; they are added.
            told: lines for people whom the other one tells; they are taken.
        """
        self.recorded, self._network, self._other = session, network, other
        there, back = network.there, network.back
        self._out, self._back = (there, back) if first else (back, there)
        self._later = int(first)
        self._signals, self._told = signals, told
        self._packet: Packet | None = None
        self._said = self._heard = 0
        self._word: Word | None = None
        self.farewell: Farewell | None = None
        other.settimeout(LOOK_S)
        plant: Any = session.lockstep.plant
        plant.link.port = self

    def send(self, payload: bytes) -> None:
        """See ``Port``."""
        self._packet = self._out.send(payload, self._network.time)

    def receive(self) -> Received | None:
        """See ``Port``; waits for what the other station said before."""
        self.say(Word(self._packet, self._ends, self.recorded.ended, self._signals, self._told))
        self._packet = None
        self._told.clear()
        self._said += 1
        while self._heard < self._said - self._later and self._hear():
            pass
        return self._back.receive(self._network.time)

    def say(self, word: Word | Farewell) -> None:
        """To the other station, if it is still there."""
        try:
            self._other.send(_encode(word))
        except (BrokenPipeError, ConnectionResetError):
            self._word = GONE

    def run(self, count: int, dt: float) -> OSError | None:
        """So many ticks of dt [s], or until one of both has to end; then until both rest.

        Returns:
            What the disk said, if it took no more.
        """
        each = self.recorded

        def tick(step: Callable[[], None]) -> None:
            step()
            self._network.advance(dt)

        try:
            while each.ticks < count and not (self._ends or (self._word and self._word.ends)):
                tick(each.step)
            tick(each.end)
            while not (each.ended and self._word and self._word.rests) and len(self._signals) < 2:
                tick(each.step)
            each.finish()
        except OSError as error:
            return error
        finally:
            each.close()
        return None

    def _listen(self) -> bytes:
        """What the other station says next; nothing where it is gone, or nobody waits for it any more."""
        while True:
            try:
                return self._other.recv(LONGEST_WORD)
            except TimeoutError:
                if len(self._signals) > 1:
                    return b""
            except ConnectionResetError:
                return b""

    def hear_out(self) -> None:
        """Say no more, and hear the other station to its end."""
        self._other.shutdown(socket.SHUT_WR)
        while self._hear():
            pass

    def take_leave(self, torn: OSError | None) -> None:
        """Say what became of it; see ``run``."""
        self.say(Farewell(self.outcome(torn), self._told))
        self.hear_out()

    def outcome(self, torn: OSError | None) -> Outcome:
        """What became of it; see ``run``."""
        self.recorded.ending.signals = tuple(self._signals)
        return self.recorded.outcome(torn, 0.0)

    @property
    def _ends(self) -> bool:
        return bool(self._signals) or over(self.recorded)

    def _hear(self) -> bool:
        """What the other station says next; whether it may say more."""
        words = self._listen()
        word = _decode(words) if words else GONE
        for said in word.told:
            show(said)
        if isinstance(word, Farewell):
            self.farewell, self._word = word, GONE
            return True
        self._heard += 1
        self._word = word
        if word.packet:
            self._back.carry(word.packet)
        if len(word.signals) > len(self._signals):
            self._signals[:] = word.signals
        return word is not GONE


def _serve(half: Half, other: Half, count: int, dt: float, far: socket.socket) -> None:
    """The other process."""
    far.close()
    other.recorded.close()
    half.take_leave(half.run(count, dt))


def run_apart(
    pair: Pair, stations: Sequence[Loaded], logs: Sequence[Path], duration: float | None, tell: bool
) -> tuple[list[Outcome], float]:
    """See ``pair_run``; the two have nothing in common but the network."""
    signals: list[int] = []
    lines: list[str] = []
    begin = perf_counter()
    count = ticks(pair, stations, duration)
    with heard(signals.append), unswept():
        both = recorded(pair, stations, logs, [teller(NAMES[0], tell), teller(NAMES[1], tell, lines.append)])
        ends = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        here, there = (
            Half(each, pair.network, i == 0, ends[i], signals, [] if i == 0 else lines)
            for i, each in enumerate(both)
        )
        process = get_context("fork").Process(target=_serve, args=(there, here, count, pair.dt, ends[0]))
        process.start()
        both[1].close()
        ends[1].close()
        try:
            torn = here.run(count, pair.dt)
            here.hear_out()
        finally:
            ends[0].close()
            if here.farewell is None:
                process.kill()  # it may be suspended
            process.join()
    speed = round(both[0].ticks * pair.dt / (perf_counter() - begin), 2)
    outcomes = [here.outcome(torn), here.farewell.outcome if here.farewell else Outcome(None, 1, LOST)]
    for each in outcomes:
        each.speed_x = speed
    return outcomes, speed
