"""One end of the link over all its sessions: what both ends have in common."""

from __future__ import annotations

import socket
import threading
from collections import deque
from typing import Final, NamedTuple

from .channel import Channel, Clock, Counts, SessionKeys, clock
from .port import Received
from .stations import Station
from .terms import Terms

MOST_EVENTS: Final = 64
"""What nobody asked for is forgotten beyond that; counters go on."""


class Event(NamedTuple):
    """What happened on the link: a word, and a sentence."""

    code: str
    text: str


class End:
    """A port (`hapticd.link.port.Port`) whose sessions come and go.

    ``send`` and ``receive`` never wait for the network, nor for a handshake: that is in a thread of its own.
    They are one thread's; all else is anybody's.
    """

    def __init__(self, terms: Terms, sends: int, clock: Clock = clock) -> None:
        self.terms: Final = terms
        self._sends, self._clock = sends, clock
        self._lock = threading.Lock()
        self._channel: Channel | None = None
        self._peer: Station | None = None
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self._last = Counts()
        self._sessions = 0
        self._alarm = False

    @property
    def sessions(self) -> int:
        """How many have begun: another number means that all was lost in between."""
        return self._sessions

    @property
    def session(self) -> int:
        """Number of the session that lives; 0 without one."""
        with self._lock:
            channel = self._living()
            return channel.session if channel else 0

    @property
    def peer(self) -> Station | None:
        """The other station while a session lives."""
        with self._lock:
            return self._peer if self._living() else None

    @property
    def silent(self) -> float:
        """Since the last packet that may move something [s]; infinite without a session."""
        with self._lock:
            channel = self._living()
            return channel.silent if channel else float("inf")

    @property
    def alarm(self) -> bool:
        """Whether the session is under attack: too many packets are dropped that no honest station sent."""
        return self._alarm

    def send(self, payload: bytes) -> None:
        """As `Port.send`; without a session nothing is sent."""
        channel = self._channel
        if channel and not channel.send(payload):
            self._look(channel)

    def receive(self) -> Received | None:
        """As `Port.receive`."""
        channel = self._channel
        if not channel:
            return None
        received = channel.receive()
        if received is None or channel.alarm is not self._alarm:
            self._look(channel)
        return received

    def fileno(self) -> int:
        """Of the session's socket, for whoever waits for packets; -1 without a session."""
        with self._lock:
            channel = self._living()
            return channel.fileno() if channel else -1

    def counts(self) -> Counts:
        """Packets of this session, or of the last one."""
        with self._lock:
            channel = self._living()
            return channel.counts() if channel else self._last

    def events(self) -> list[Event]:
        """What happened since the last call."""
        found = []
        while self._events:
            found.append(self._events.popleft())
        return found

    def _say(self, code: str, text: str) -> None:
        self._events.append(Event(code, text))

    def _look(self, channel: Channel) -> None:
        """What that session's last call changed."""
        if not channel.over and channel.alarm is self._alarm:
            return
        with self._lock:
            if channel is not self._channel:
                return
            if self._living() and channel.alarm is not self._alarm:
                self._alarm = channel.alarm
                self._say("attack" if self._alarm else "attack_over", f"packets dropped: {channel.counts()}")

    def _living(self) -> Channel | None:
        """The session, if its lease is not over; the lock is held."""
        if self._channel and self._channel.expired:
            self._end(f"silent for {self.terms.lease:g} s: the lease is over")
        return self._channel

    def _begin(self, sock: socket.socket, keys: SessionKeys, peer: Station) -> None:
        """A session begins; the lock is held."""
        self._channel = Channel(sock, keys, self._sends, self.terms, self._clock)
        self._peer, self._sessions = peer, self._sessions + 1
        self._say("session_began", f"session {keys.session:016x} with {peer}")

    def _end(self, why: str) -> None:
        """The session is over, its keys are forgotten; the lock is held."""
        assert self._channel is not None
        self._last = self._channel.counts()
        self._channel.close()
        self._say("session_ended", f"session {self._channel.session:016x} with {self._peer}: {why}")
        self._channel = self._peer = None
        self._alarm = False
