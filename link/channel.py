"""One session's packets: sealed, told apart, dated, and counted."""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from ._inbox import ffi, lib
from .port import Received
from .ratchet import Ratchet
from .sealing import Sealing
from .terms import OVERHEAD, Terms

HEADER: Final = struct.Struct("<HBBQQ")
"""In the clear, and authenticated: magic, version, direction, session, counter."""
STAMPS: Final = struct.Struct("<QQI")
"""Sealed before the payload: sender's clock, newest stamp of the other side that it has heard, how long ago
that was [ns]; csrc/link.c writes and reads all of these."""
TO_AVATAR, TO_OPERATOR = 0, 1
"""Directions."""
LAST: Final = 1 << lib.LINK_COUNTER_BITS
"""Counter at which a session ends; at 1 kHz after 8900 years."""
ALARM: Final = 100
"""Packets dropped within a second that nobody explains by a network alone."""
EPOCH_BITS: Final = lib.LINK_EPOCH_BITS
OVER, OPENS, WATCH = lib.LINK_OVER, lib.LINK_OPENS, lib.LINK_WATCH
SECOND: Final = 1_000_000_000
COUNTED_IN_C: Final = (
    *("received", "reordered", "stale", "unproven", "forged"),
    *("ahead", "duplicate", "replayed", "reflected", "foreign", "truncated", "oversize", "shed"),
)

Clock = Callable[[], int]


# a packet's way is short, and caches are cold: what is looked up or called for each one is felt
_send, _receive, _received = lib.link_channel_send, lib.link_channel_receive, tuple.__new__


def clock() -> int:
    """Nanoseconds since the host booted, sleep included; no change of the time of day moves it."""
    return int(lib.link_clock())


_clock: Final = clock


class SessionKeys(NamedTuple):
    """What both stations know after the handshake, and nobody else.

    Attributes:
        session: random number of the session, which its packets bear in the clear.
        to_avatar, to_operator: what the keys of each direction begin with.
    """

    session: int
    to_avatar: bytes
    to_operator: bytes


@dataclass(slots=True)
class Counts:
    """Packets of a session; those below `received` were dropped.

    Attributes:
        sent, unsent: by us; what the kernel did not take.
        received: authentic ones, each once.
        lost: counters that did not come within the window.
        reordered: came after a newer one; counted in `received`, too, and not used.
        stale: authentic and the newest, but older than the declared delay.
        unproven: authentic, but bear no stamp of ours yet: their age is unknown.
        deaf: authentic, but their sender has not heard of us for too long.
        forged: not sealed with the key of the session.
        ahead: a counter beyond the next key's.
        duplicate, replayed: the counter had come; behind the window nobody can tell whether it had.
        reflected: our own, sent back to us.
        foreign: of no session, or of another one.
        truncated, oversize: of the wrong length.
        shed: too many came at once.
        unreachable: times the network said that nobody listens there.
    """

    sent: int = 0
    unsent: int = 0
    received: int = 0
    lost: int = 0
    reordered: int = 0
    stale: int = 0
    unproven: int = 0
    deaf: int = 0
    forged: int = 0
    ahead: int = 0
    duplicate: int = 0
    replayed: int = 0
    reflected: int = 0
    foreign: int = 0
    truncated: int = 0
    oversize: int = 0
    shed: int = 0
    unreachable: int = 0

    @property
    def refused(self) -> int:
        """Packets that no honest station sent in this way."""
        wrong = self.forged + self.ahead + self.replayed + self.reflected
        return wrong + self.foreign + self.truncated + self.oversize


class Channel:
    """A session between this station and the other one over a connected datagram socket.

    It neither blocks nor raises for anything that comes from the network. One thread sends and receives;
    any may close it.
    """

    def __init__(
        self, sock: socket.socket, keys: SessionKeys, sends: int, terms: Terms, clock: Clock = clock
    ) -> None:
        """Begin a session.

        Args:
            sock: connected to the other station; it becomes the channel's own.
            keys: of the session.
            sends: direction of what this station sends, TO_AVATAR or TO_OPERATOR.
            terms: what was agreed on.
            clock: [ns], never backwards; of this station alone.
        """
        sock.setblocking(False)
        self._socket, self._clock, self.terms = sock, clock, terms
        self._given: Final = None if clock is _clock else clock
        self.session: Final = keys.session
        roots = (keys.to_avatar, keys.to_operator)
        self._seals, self._opens = Ratchet(roots[sends]), Ratchet(roots[1 - sends])
        self._at = at = ffi.new("link_channel *")
        at.fd, at.good, at.lease = sock.fileno(), clock(), round(terms.lease * SECOND)
        at.since = at.now = at.good
        self._inbox, self._outbox = inbox, outbox = at.inbox, at.outbox
        inbox.session, inbox.direction, inbox.size = keys.session, 1 - sends, terms.receives + OVERHEAD
        inbox.window.seen = 2**64 - 1
        inbox.oldest, inbox.deaf = round(terms.oldest * SECOND), round(terms.deaf * SECOND)
        self._payload = memoryview(ffi.buffer(inbox.payload))[: terms.receives]
        self._size: Final = terms.sends
        outbox.session, outbox.direction, outbox.size = keys.session, sends, self._size
        self._seal_with(0)
        self._open_with(0)
        self._refused_before = 0
        self.alarm = False
        """More than ALARM packets a second are dropped that no honest station sent."""

    def fileno(self) -> int:
        """Of the socket, for whoever waits for packets."""
        return self._socket.fileno()

    def close(self) -> None:
        """Forget the keys and give the socket back."""
        lib.link_channel_close(self._at)
        self._at.fd = -1
        self._socket.close()
        self._seals = self._opens = Ratchet(bytes(32))
        self._seal_with(0)
        self._open_with(0)

    @property
    def over(self) -> bool:
        """The lease is over, or the channel closed; nothing is sent or received any more."""
        return bool(self._at.over)

    @property
    def silent(self) -> float:
        """Since the last packet that may move something, or since the session began [s]."""
        return float((self._clock() - self._at.good) / SECOND)

    @property
    def expired(self) -> bool:
        """Whether the lease is over by now."""
        if self._clock() - self._at.good > self._at.lease:
            self._at.over = True
        return self.over

    def send(self, payload: bytes) -> bool:
        """Seal and send; what the kernel does not take is counted and gone.

        Returns:
            Whether the session goes on.

        Raises:
            ValueError: the payload is not as long as was agreed on.
        """
        if len(payload) != self._size:
            raise ValueError(f"{len(payload)} bytes to send; {self._size} were agreed on")
        if self._given:
            self._at.given = self._given()
        while said := _send(self._at, payload):
            if said == OVER:
                return False
            self._seal_with((self._at.counter + 1) >> EPOCH_BITS)
        return True

    def receive(self) -> Received | None:
        """The newest authentic packet since the last call, if it is fresh enough to move something."""
        if self._given:
            self._at.given = self._given()
        age = _receive(self._at)
        if age < 0:
            age = self._answered(age)
            if age < 0:
                return None
        return _received(Received, (self._payload.tobytes(), age / SECOND))

    def counts(self) -> Counts:
        """What has become of all packets so far."""
        inbox, outbox = self._inbox, self._outbox
        return Counts(
            sent=outbox.sent,
            unsent=outbox.unsent,
            deaf=inbox.deafened,
            lost=inbox.window.lost,
            unreachable=outbox.unreachable + inbox.failures,
            **{name: getattr(inbox, name) for name in COUNTED_IN_C},
        )

    def _answered(self, said: int) -> int:
        """After what C asks for, the age of the newest [ns]; below 0 where none is to move something."""
        while said == OPENS:
            self._open_with(self._inbox.window.newest >> EPOCH_BITS)
            said = _receive(self._at)
        if said != WATCH:
            return said
        self._watch(self._at.now)
        return int(self._at.age)

    def _seal_with(self, epoch: int) -> None:
        self._seals.reached(epoch)
        self._outbox.epoch, self._outbox.now = epoch, _pointer(self._seals.now)

    def _open_with(self, epoch: int) -> None:
        """The keys of that epoch and of its neighbours."""
        inbox, opens = self._inbox, self._opens
        opens.reached(epoch)
        inbox.epoch = epoch
        inbox.before, inbox.now, inbox.next = map(_pointer, map(opens.at, (epoch - 1, epoch, epoch + 1)))

    def _watch(self, now: int) -> None:
        """Once a second: whether too many packets are dropped."""
        refused = self.counts().refused
        self.alarm = (refused - self._refused_before) * SECOND > ALARM * (now - self._at.since)
        self._refused_before, self._at.since = refused, now


def _pointer(sealing: Sealing | None) -> Any:
    return sealing.at if sealing else ffi.NULL
