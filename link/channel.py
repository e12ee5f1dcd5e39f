"""One session's packets: sealed, told apart, dated, and counted."""

from __future__ import annotations

import socket
import struct
import time
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
LAST: Final = 1 << 48
"""Counter at which a session ends; at 1 kHz after 8900 years."""
ALARM: Final = 100
"""Packets dropped within a second that nobody explains by a network alone."""
EPOCH_BITS: Final = lib.LINK_EPOCH_BITS
EPOCH: Final = (1 << EPOCH_BITS) - 1
SECOND: Final = 1_000_000_000
COUNTED_IN_C: Final = (
    *("received", "reordered", "stale", "unproven", "forged"),
    *("ahead", "duplicate", "replayed", "reflected", "foreign", "truncated", "oversize", "shed"),
)

Clock = Callable[[], int]


def clock() -> int:
    """Nanoseconds since the host booted, sleep included; no change of the time of day moves it."""
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME)


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

    It neither blocks nor raises for anything that comes from the network. One thread uses it.
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
        self.session: Final = keys.session
        roots = (keys.to_avatar, keys.to_operator)
        self._seals, self._opens = Ratchet(roots[sends]), Ratchet(roots[1 - sends])
        self._counter = 0
        self._inbox = inbox = ffi.new("link_inbox *")
        inbox.session, inbox.direction, inbox.size = keys.session, 1 - sends, terms.receives + OVERHEAD
        inbox.window.seen = 2**64 - 1
        self._lease, inbox.oldest, inbox.deaf = (
            round(seconds * SECOND) for seconds in (terms.lease, terms.oldest, terms.deaf)
        )
        self._payload = memoryview(ffi.buffer(inbox.payload))[: terms.receives]
        self._outbox = outbox = ffi.new("link_outbox *")
        outbox.session, outbox.direction, outbox.size = keys.session, sends, terms.sends
        self._give_keys(0)
        self._fd = sock.fileno()
        self._good = self._since = clock()
        self._refused_before = 0
        self.over = False
        """The lease is over, or the channel closed; nothing is sent or received any more."""
        self.alarm = False
        """More than ALARM packets a second are dropped that no honest station sent."""

    def fileno(self) -> int:
        """Of the socket, for whoever waits for packets."""
        return self._socket.fileno()

    def close(self) -> None:
        """Forget the keys and give the socket back."""
        self.over, self._fd = True, -1
        self._socket.close()
        self._seals = self._opens = Ratchet(bytes(32))
        self._give_keys(0)

    @property
    def silent(self) -> float:
        """Since the last packet that may move something, or since the session began [s]."""
        return (self._clock() - self._good) / SECOND

    @property
    def expired(self) -> bool:
        """Whether the lease is over by now."""
        self.over = self.over or self._clock() - self._good > self._lease
        return self.over

    def send(self, payload: bytes) -> None:
        """Seal and send; what the kernel does not take is counted and gone.

        Raises:
            ValueError: the payload is not as long as was agreed on.
        """
        if len(payload) != self.terms.sends:
            raise ValueError(f"{len(payload)} bytes to send; {self.terms.sends} were agreed on")
        now, counter = self._clock(), self._counter + 1
        self.over = self.over or now - self._good > self._lease or counter >= LAST
        if self.over:
            self._outbox.unsent += 1
            return
        self._counter = counter  # before it is used: none is ever used twice
        if not counter & EPOCH:
            self._seals.reached(counter >> EPOCH_BITS)
            self._give_keys(self._inbox.epoch)
        lib.link_send(self._fd, self._outbox, self._inbox, counter, now, payload)

    def receive(self) -> Received | None:
        """The newest authentic packet since the last call, if it is fresh enough to move something."""
        if self.over:
            return None
        inbox = self._inbox
        lib.link_receive(self._fd, inbox)
        now = self._clock()
        if now - self._good > self._lease:
            self.over = True
            return None
        if now - self._since >= SECOND:
            self._watch(now)
        age = lib.link_open(inbox, now)
        epoch = inbox.window.newest >> EPOCH_BITS
        if epoch != inbox.epoch:
            self._opens.reached(epoch)
            self._give_keys(epoch)
        if age < 0:
            return None
        self._good = now
        return Received(self._payload.tobytes(), age / SECOND)

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

    def _give_keys(self, epoch: int) -> None:
        """C seals with the key that the ratchet has, opens with that epoch's and its neighbours'."""
        inbox, opens = self._inbox, self._opens
        inbox.epoch = epoch
        inbox.before, inbox.now, inbox.next = map(_pointer, map(opens.at, (epoch - 1, epoch, epoch + 1)))
        self._outbox.now = _pointer(self._seals.now)

    def _watch(self, now: int) -> None:
        """Once a second: whether too many packets are dropped."""
        refused = self.counts().refused
        self.alarm = (refused - self._refused_before) * SECOND > ALARM * (now - self._since)
        self._refused_before, self._since = refused, now


def _pointer(sealing: Sealing | None) -> Any:
    return sealing.at if sealing else ffi.NULL
