"""Packets that nobody honest sent: forged, replayed, damaged, cut, reflected, of other sessions.

HAPTICD_ATTACKS=10000000 sends that many.
"""

from __future__ import annotations

import os
import random
import socket

import pytest
from hapticd.link.channel import TO_AVATAR, TO_OPERATOR, Channel, SessionKeys
from hapticd.link.terms import OVERHEAD, Terms

from .conftest import KEYS, Ticker

MANY = int(os.environ.get("HAPTICD_ATTACKS", 100_000))
SIZE = 60
TERMS = Terms(sends=SIZE, receives=SIZE, oldest=0.05)


class Attacker:
    """Hears all, keeps the last thousand packets of either direction, and of a session before."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.heard: list[bytes] = []
        self.kinds = [
            (self.replay, 3),
            (self.mutate, 4),
            (self.garbage, 1),
            (self.resize, 1),
            (self.forge, 4),
            (self.splice, 2),
            (self.renumber, 3),
        ]

    def hear(self, packet: bytes) -> None:
        self.heard.append(packet)
        if len(self.heard) > 2000:
            del self.heard[:1000]

    def packet(self) -> bytes:
        (make,) = self.chance.choices([make for make, _ in self.kinds], [weight for _, weight in self.kinds])
        return make()

    def replay(self) -> bytes:
        return self.chance.choice(self.heard)

    def mutate(self) -> bytes:
        """A few bits are turned over."""
        packet = bytearray(self.chance.choice(self.heard[-10:]))
        for _ in range(self.chance.choice((1, 1, 2, 8))):
            packet[self.chance.randrange(len(packet))] ^= 1 << self.chance.randrange(8)
        return bytes(packet)

    def garbage(self) -> bytes:
        return self.chance.randbytes(self.chance.choice((1, 20, SIZE + OVERHEAD, 1400)))

    def resize(self) -> bytes:
        packet = self.replay()
        return packet[: self.chance.randrange(len(packet))] if self.chance.random() < 0.5 else packet + b"\0"

    def forge(self) -> bytes:
        """A header that is as it should be, with a counter that is wanted, and anything behind it."""
        header = bytearray(self.heard[-1][:20])
        header[12:20] = (int.from_bytes(header[12:20], "little") + self.chance.randrange(1, 60)).to_bytes(
            8, "little"
        )
        return bytes(header) + self.chance.randbytes(SIZE + OVERHEAD - 20)

    def splice(self) -> bytes:
        """The header of one packet, the content of another."""
        packet = self.chance.choice(self.heard[-50:])
        return self.forge()[:20] + packet[20:]

    def renumber(self) -> bytes:
        """Another counter, direction or session on an authentic packet."""
        packet = bytearray(self.chance.choice(self.heard))
        where = self.chance.choice((3, 4, 12, 13, 14, 15, 19))
        packet[where] = self.chance.randrange(256)
        return bytes(packet)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_of_all_wrong_packets_none_is_accepted_and_every_right_one_is(seed: int) -> None:
    """Every right packet is accepted once, with what it said; everything else leaves no trace but a count."""
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    time, attacker = Ticker(), Attacker(seed)
    before = SessionKeys(KEYS.session, bytes(32), bytes(32))  # a session of the same number, and other keys
    ours, theirs = Channel(left, KEYS, TO_AVATAR, TERMS, time), Channel(right, KEYS, TO_OPERATOR, TERMS, time)
    tap, end = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    old = Channel(tap, before, TO_AVATAR, TERMS, time)
    for _ in range(20):
        old.send(bytes(SIZE))
        attacker.hear(end.recv(2000))
    sent = attacks = 0
    accepted = None
    for turn in range(MANY // 4 // 16 + 1):
        payload = attacker.chance.randbytes(SIZE)
        ours.send(payload)
        authentic = theirs._socket.recv(2000)
        attacker.hear(authentic)
        at = attacker.chance.randrange(17)
        for place in range(17):
            if place == at:
                left.send(authentic)
                continue
            packet = attacker.packet()
            attacks += 1
            # the first copy of the newest packet is that packet, whoever brings it
            left.send(packet if packet != authentic else attacker.garbage())
        received = theirs.receive()
        assert (received is not None and received.payload == payload) or turn < 1
        sent += 1
        accepted = theirs.counts().received
        assert accepted == sent, turn
        theirs.send(payload)
        back = left.recv(2000)
        attacker.hear(back)
        right.send(back)
        ours.receive()
        time.wait(1e-3)
    counts = theirs.counts()
    assert attacks >= MANY // 4
    assert counts.received == sent and counts.lost == counts.reordered == 0
    assert counts.refused + counts.duplicate == attacks
    for each in (counts.forged, counts.replayed, counts.duplicate, counts.reflected, counts.foreign):
        assert each > 0
    for each in (counts.truncated, counts.oversize, counts.ahead):
        assert each > 0
    for channel in (ours, theirs, old):
        channel.close()
    end.close()
