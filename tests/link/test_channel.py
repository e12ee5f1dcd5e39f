"""A session's packets."""

from __future__ import annotations

import socket
import sys
import threading
import time
from dataclasses import replace

import pytest
from hapticd.link import ratchet
from hapticd.link._inbox import ffi, lib
from hapticd.link.channel import HEADER, LAST, STAMPS, TO_AVATAR, TO_OPERATOR, Channel, clock
from hapticd.link.end import End
from hapticd.link.sealing import SIGNATURE, Sealing, in_python, sealing
from hapticd.link.stations import Role, Station
from hapticd.link.terms import OVERHEAD, Terms, difference

from .conftest import AVATAR, KEYS, OPERATOR, Pair, until

MS = 1_000_000


def packet(pair: Pair, payload: bytes | None = None) -> bytes:
    """What the operator sends next, taken off the wire."""
    pair.operator.send(bytes(40) if payload is None else payload)
    return pair.avatar._socket.recv(2000)


def test_payloads_come_as_they_were_sent_with_their_age(pair: Pair) -> None:
    for turn in range(5):
        payload = bytes([turn]) * 40
        pair.operator.send(payload)
        pair.time.wait(0.004)
        received = pair.avatar.receive()
        assert received is not None and received.payload == payload
        assert 0.001 < received.age < 0.0041  # half of what the waiting adds to the round trip at the most
        pair.exchange()
    assert pair.avatar.receive() is None
    assert pair.avatar.counts().received == 3 + 2 * 5
    assert pair.avatar.counts().refused == 0


def test_the_overhead_is_what_the_manual_says(pair: Pair) -> None:
    sent = packet(pair)
    assert len(sent) == 40 + OVERHEAD
    assert OVERHEAD == HEADER.size + STAMPS.size + 16 and HEADER.size == lib.LINK_HEADER
    assert HEADER.unpack_from(sent) == (lib.LINK_MAGIC, 1, TO_AVATAR, KEYS.session, 4)


def test_only_the_newest_packet_is_received_and_the_others_are_counted(pair: Pair) -> None:
    first, second, third = (packet(pair, bytes([n]) * 40) for n in range(3))
    wire = pair.operator._socket
    for each in (second, first, second):
        wire.send(each)
    received = pair.avatar.receive()
    assert received is not None and received.payload == b"\x01" * 40
    wire.send(first)
    wire.send(third)
    received = pair.avatar.receive()
    assert received is not None and received.payload == b"\x02" * 40
    counts = pair.avatar.counts()
    assert (counts.received, counts.reordered, counts.duplicate) == (6, 1, 2)


def test_nothing_is_received_twice_or_after_a_newer_one(pair: Pair) -> None:
    first, second = packet(pair), packet(pair)
    wire = pair.operator._socket
    wire.send(second)
    assert pair.avatar.receive()
    for old in (first, second, first):
        wire.send(old)
        assert pair.avatar.receive() is None


def test_a_packet_sent_back_to_its_sender_is_none() -> None:
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    ours = Channel(left, KEYS, TO_AVATAR, Terms(sends=40, receives=40, oldest=0.05))
    ours.send(bytes(40))
    sent = right.recv(2000)
    right.send(sent)
    turned = bytearray(sent)
    turned[3] = TO_OPERATOR  # as if it went the other way
    right.send(turned)
    assert ours.receive() is None
    counts = ours.counts()
    assert (counts.reflected, counts.forged, counts.received) == (1, 1, 0)
    ours.close()
    right.close()


def test_every_flipped_bit_makes_a_packet_worthless(pair: Pair) -> None:
    sent = packet(pair)
    before = pair.avatar.counts().received
    for bit in range(8 * len(sent)):
        forged = bytearray(sent)
        forged[bit // 8] ^= 1 << bit % 8
        pair.operator._socket.send(forged)
        assert pair.avatar.receive() is None, bit
    counts = pair.avatar.counts()
    assert counts.received == before and counts.forged + counts.refused > 8 * OVERHEAD
    pair.operator._socket.send(sent)
    assert pair.avatar.receive() is not None  # and the session is as it was


def test_a_packet_of_another_session_is_none(pair: Pair) -> None:
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    for other in (KEYS._replace(session=1), KEYS._replace(to_avatar=bytes(32))):
        stranger = Channel(left.dup(), other, TO_AVATAR, OPERATOR, pair.time)
        stranger.send(bytes(40))
        pair.operator._socket.send(right.recv(2000))
        assert pair.avatar.receive() is None
        stranger.close()
    left.close()
    right.close()
    counts = pair.avatar.counts()
    assert counts.foreign + counts.forged + counts.duplicate == 2


def test_a_packet_older_than_the_declared_delay_moves_nothing(pair: Pair) -> None:
    pair.operator.send(bytes(40))
    pair.time.wait(0.06)
    assert pair.avatar.receive() is None
    assert pair.avatar.counts().stale == 1
    pair.exchange(2)
    pair.operator.send(bytes(40))
    assert pair.avatar.receive() is not None


def test_no_delay_of_the_network_makes_a_packet_older_than_twice_the_declared_one(pair: Pair) -> None:
    """Held back from the first packet on, half of the round trip looks like its age; more is not believed."""
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    ours = Channel(left, KEYS, TO_AVATAR, OPERATOR, pair.time)
    theirs = Channel(right, KEYS, 1, AVATAR, pair.time)
    accepted = []
    for delay in (0.09, 0.11):  # of the packets to the avatar; those back are fast
        for _ in range(4):
            theirs.send(bytes(24))
            ours.receive()
            ours.send(bytes(40))
            pair.time.wait(delay)
            accepted.append((delay, theirs.receive() is not None))
    assert set(accepted) == {(0.09, True), (0.11, False)}
    ours.close()
    theirs.close()


def test_a_packet_that_comes_fast_but_answers_an_old_one_moves_nothing(pair: Pair) -> None:
    """Its age is likely small, by what was heard before; that it is, nobody can prove any more."""
    pair.exchange(50)
    for delay, moves in ((0.08, True), (0.12, False)):
        pair.avatar.send(bytes(24))
        pair.time.wait(delay)
        pair.operator.receive()
        pair.operator.send(bytes(40))
        assert (pair.avatar.receive() is not None) == moves
    assert pair.avatar.counts().stale == 1


def test_a_packet_whose_sender_has_heard_nothing_of_us_moves_nothing() -> None:
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    ours, theirs = Channel(left, KEYS, TO_AVATAR, OPERATOR), Channel(right, KEYS, 1, AVATAR)
    for _ in range(5):
        ours.send(bytes(40))
        assert theirs.receive() is None
    assert theirs.counts().unproven == 5
    theirs.send(bytes(24))
    assert ours.receive() is not None  # it answers packets of ours
    ours.send(bytes(40))
    assert theirs.receive() is not None
    ours.close()
    theirs.close()


def test_a_station_that_does_not_hear_us_moves_nothing_and_loses_its_lease(pair: Pair) -> None:
    """One direction is dead: both sides stop, not one alone."""
    accepted = 0
    for _ in range(2100):
        pair.operator.send(bytes(40))
        accepted += pair.avatar.receive() is not None
        pair.avatar.send(bytes(24))
        pair.operator._socket.recv(2000)  # is lost
        pair.time.wait(1e-3)
    assert 95 <= accepted <= 101
    assert pair.avatar.counts().deaf > 1800
    assert pair.operator.expired


def test_the_lease_ends_after_two_seconds_of_silence_and_no_packet_renews_it(pair: Pair) -> None:
    late = packet(pair)
    pair.time.wait(1.9)
    assert not pair.avatar.expired
    pair.exchange(3)
    pair.time.wait(2.01)
    assert pair.avatar.expired and pair.operator.expired
    pair.operator._socket.send(late)
    assert pair.avatar.receive() is None
    pair.operator.send(bytes(40))
    assert pair.operator.counts().unsent == 1
    assert pair.avatar.expired


def test_no_packet_however_fresh_revives_a_lease_that_is_over(pair: Pair) -> None:
    for _ in range(199):
        pair.avatar.send(bytes(24))
        pair.operator.receive()
        pair.operator.send(bytes(40))
        pair.avatar._socket.recv(2000)  # is lost
        pair.time.wait(0.01)
    pair.time.wait(0.02)
    pair.operator.send(bytes(40))
    assert pair.avatar.receive() is None and pair.avatar.over


def test_packets_that_come_too_late_do_not_hold_the_lease(pair: Pair) -> None:
    """Each one second old: authentic, in order, and worth nothing."""
    waiting: list[bytes] = []
    for turn in range(2100):
        if not pair.operator.expired:
            waiting.append(packet(pair))
            pair.avatar.send(bytes(24))
            pair.operator.receive()
        if turn >= 1000 and not pair.avatar.expired:
            pair.operator._socket.send(waiting.pop(0))
            assert pair.avatar.receive() is None
        pair.time.wait(1e-3)
    assert pair.avatar.expired and pair.avatar.counts().stale > 900


def test_a_nonce_is_used_once_with_each_key_also_where_keys_change(
    pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    used: list[tuple[bytes, bytes]] = []

    def spied(key: bytes, salt: bytes) -> Sealing:
        real = sealing(key, salt)

        @ffi.callback(SIGNATURE)
        def seal(at: object, header: object, content: object, size: int, sealed: object) -> int:
            used.append((key, salt + bytes(ffi.buffer(header, 20))[12:]))
            return int(real.at.seal(at, header, content, size, sealed))

        return Sealing(
            ffi.new("link_sealing *", {"key": real.at.key, "seal": seal, "open": real.at.open}), (real, seal)
        )

    monkeypatch.setattr(ratchet, "sealing", spied)
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    ends = [Channel(left, KEYS, 0, OPERATOR, pair.time), Channel(right, KEYS, 1, AVATAR, pair.time)]
    both = Pair(ends[0], ends[1], pair.time)
    keys = set()
    for epoch in range(4):
        both.exchange(10)
        for end in ends:
            end._at.counter = ((epoch + 1) << lib.LINK_EPOCH_BITS) - 5
        both.exchange(10)  # the last five of one key, the first five of the next
        keys.add(used[-1][0])
    assert len(used) == len(set(used)) == 2 * 4 * 20
    assert len(keys) == 4 and len({key for key, _ in used}) == 2 * 5
    assert ends[1].counts().received == ends[0].counts().received == 80
    assert ends[1].counts().forged == 0
    for end in ends:
        end.close()


def test_nothing_is_sealed_with_the_key_of_another_epoch_nor_opened_before_there_are_keys(pair: Pair) -> None:
    """C asks for them, does nothing, and asks until it has them."""
    ours, theirs = pair.operator._at, pair.avatar._at
    ours.counter = (1 << lib.LINK_EPOCH_BITS) - 1
    before = pair.operator.counts()
    for _ in range(2):
        assert lib.link_channel_send(ours, bytes(40)) == lib.LINK_SEALS
    assert pair.operator.counts() == before and ours.counter == (1 << lib.LINK_EPOCH_BITS) - 1
    assert pair.avatar.receive() is None
    pair.operator.send(bytes(40))
    assert ours.outbox.epoch == 1 and pair.avatar.receive() is not None
    taken = theirs.inbox.taken
    pair.operator.send(bytes(40))
    for _ in range(2):
        assert lib.link_channel_receive(theirs) == lib.LINK_OPENS
    assert theirs.inbox.taken == taken
    assert pair.avatar.receive() is not None and theirs.inbox.epoch == 1


def test_packets_of_the_key_before_are_opened_within_the_window(pair: Pair) -> None:
    pair.operator._at.counter = (1 << lib.LINK_EPOCH_BITS) - 3
    packets = [packet(pair) for _ in range(6)]
    for each in reversed(packets):
        pair.operator._socket.send(each)
        pair.avatar.receive()
    counts = pair.avatar.counts()
    assert (counts.received, counts.reordered, counts.forged) == (3 + 6, 5, 0)


def test_a_session_ends_before_its_counters_do(pair: Pair) -> None:
    pair.operator._at.counter = LAST - 2
    before = pair.operator.counts().sent
    pair.operator.send(bytes(40))
    assert pair.operator.counts().sent == before + 1 and not pair.operator.expired
    pair.operator.send(bytes(40))
    assert pair.operator.counts().sent == before + 1 and pair.operator.expired


def test_a_payload_of_another_length_is_a_mistake_here(pair: Pair) -> None:
    for size in (0, 39, 41):
        with pytest.raises(ValueError, match="40 were agreed on"):
            pair.operator.send(bytes(size))


def test_the_clock_is_the_one_that_counts_sleep_and_that_nobody_sets() -> None:
    """So it is of a channel that is given none: no step of the time of day does anything to a packet."""
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    both = [Channel(left, KEYS, 0, OPERATOR), Channel(right, KEYS, 1, AVATAR)]
    ages = []
    for _ in range(12):
        seen = [time.clock_gettime_ns(time.CLOCK_BOOTTIME), clock()]
        both[0].send(bytes(40))
        received = both[1].receive()
        seen += [both[1]._at.now, clock(), time.clock_gettime_ns(time.CLOCK_BOOTTIME)]
        assert seen == sorted(seen)
        both[1].send(bytes(24))
        both[0].receive()
        ages.append(received.age if received else None)
    assert ages[0] is None and all(age is not None and 0.0 <= age < 1.0 for age in ages[1:])
    assert not both[0].expired
    assert both[1]._inbox.ages.jumps == 0
    for each in both:
        each.close()


def test_a_peer_whose_own_clock_jumps_is_believed_again_with_the_next_answer(pair: Pair) -> None:
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    theirs = type(pair.time)(10**15)
    ours = Channel(left, KEYS, 0, OPERATOR, pair.time)
    other = Channel(right, KEYS, 1, AVATAR, theirs)
    both = Pair(ours, other, pair.time)
    got: list[float | None] = []
    for turn in range(40):
        if turn == 20:
            theirs.wait(1.5)
        ours.send(bytes(40))
        other.receive()
        other.send(bytes(24))
        received = ours.receive()
        got.append(received.age if received else None)
        for each in (pair.time, theirs):
            each.wait(1e-3)
    assert both.operator.counts().deaf + both.operator.counts().unproven <= 2
    assert all(age is None or 0.0 <= age < 0.01 for age in got)
    assert got[-1] is not None
    ours.close()
    other.close()


def test_a_network_that_says_nobody_listens_is_counted_and_nothing_more() -> None:
    here = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    there = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    here.bind(("127.0.0.1", 0))
    there.bind(("127.0.0.1", 0))
    here.connect(there.getsockname())
    there.close()
    channel = Channel(here, KEYS, TO_AVATAR, OPERATOR)
    for _ in range(6):
        channel.send(bytes(40))
        assert channel.receive() is None
    assert channel.counts().unreachable > 0
    channel.close()


def test_what_the_kernel_does_not_take_is_counted(pair: Pair) -> None:
    while pair.operator.counts().unsent == 0:  # nobody receives
        pair.operator.send(bytes(40))
    assert pair.operator.counts().sent > 3

    before = pair.operator.counts()
    pair.operator._at.fd = -1
    pair.operator.send(bytes(40))
    assert pair.operator.counts() == replace(before, unsent=before.unsent + 1)


def test_a_packet_that_cannot_be_sealed_is_not_sent(pair: Pair) -> None:
    @ffi.callback(SIGNATURE)
    def fails(*_: object) -> int:
        return 0

    before = pair.operator.counts()
    pair.operator._seals.now.at.seal = fails
    pair.operator.send(bytes(40))
    assert pair.operator.counts() == replace(before, unsent=before.unsent + 1)
    assert pair.avatar.receive() is None and pair.avatar.counts().refused == 0


def test_an_end_that_seals_in_python_speaks_with_one_that_does_in_c(
    pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    other = Channel(right, KEYS, TO_OPERATOR, AVATAR, pair.time)
    monkeypatch.setattr(ratchet, "sealing", in_python)
    both = Pair(Channel(left, KEYS, TO_AVATAR, OPERATOR, pair.time), other, pair.time)
    both.operator._at.counter = (1 << lib.LINK_EPOCH_BITS) - 5  # keys change, too
    both.exchange(10)
    forged = bytearray(packet(both))
    forged[-1] ^= 1
    left.send(forged)
    left.send(bytes(40 + OVERHEAD))
    assert other.receive() is None
    for end in both[:2]:
        counts = end.counts()
        assert counts.received == 10 and counts.unsent == 0
        end.close()
    assert other.counts().forged == other.counts().foreign == 1


def test_an_alarm_tells_of_more_than_a_hundred_wrong_packets_a_second(pair: Pair) -> None:
    def second(wrong: int) -> bool:
        for turn in range(1000):
            if turn < wrong:
                pair.operator._socket.send(b"x")
            pair.exchange()
        return pair.avatar.alarm

    assert [second(wrong) for wrong in (90, 130, 0)] == [False, True, False]


def test_a_channel_that_is_closed_says_and_hears_nothing(pair: Pair) -> None:
    pair.operator.close()
    pair.operator.send(bytes(40))
    assert pair.operator.receive() is None
    assert pair.operator.expired


def test_who_closes_waits_for_a_packet_under_way_and_then_none_is_sent(pair: Pair) -> None:
    begun, goes_on = threading.Event(), threading.Event()

    @ffi.callback(SIGNATURE)
    def slow(*_: object) -> int:
        begun.set()
        goes_on.wait(30.0)
        return 0

    channel = pair.operator
    channel._seals.now.at.seal = slow
    sends = threading.Thread(target=channel.send, args=(bytes(40),))
    closes = threading.Thread(target=channel.close)
    sends.start()
    assert begun.wait(30.0)
    closes.start()
    until(lambda: channel.over)
    time.sleep(0.02)
    assert channel.fileno() >= 0 and closes.is_alive()
    assert not channel.send(bytes(40)) and channel.receive() is None  # nobody else begins
    goes_on.set()
    for thread in (sends, closes):
        thread.join(30.0)
        assert not thread.is_alive()
    assert channel.fileno() == -1


def test_a_packets_way_is_short(pair: Pair) -> None:
    """Each function more is felt where caches are cold, as they are after a millisecond of others' work."""
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    ours, theirs = End(OPERATOR, TO_AVATAR), End(AVATAR, TO_OPERATOR)
    for end, sock in ((ours, left), (theirs, right)):
        end._begin(sock, KEYS, Station("other", Role.AVATAR))
    passed: list[str] = []

    def note(_: object, event: str, called: object) -> None:
        passed.append(event)

    for _ in range(3):
        passed.clear()
        sys.setprofile(note)
        ours.send(bytes(40))
        received = theirs.receive()
        sys.setprofile(None)
        theirs.send(bytes(24))
        ours.receive()
    assert received is not None
    assert passed.count("call") == 4  # of an end and of its session, each way
    assert passed.count("c_call") <= 7  # len and C to send; C, bytes, a tuple to receive; this profile's end
    for end in (ours, theirs):
        end._end("done")


def test_neither_sends_nor_receives_wait_for_who_holds_an_end() -> None:
    """A handshake's thread holds it, and may be of a lower priority."""
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    end = End(OPERATOR, TO_AVATAR)
    end._begin(left, KEYS, Station("robot", Role.AVATAR))

    def turn() -> None:
        end.send(bytes(40))
        end.receive()

    with end._lock:
        thread = threading.Thread(target=turn)
        thread.start()
        thread.join(30.0)
        assert not thread.is_alive()
    assert end.counts().sent == 1
    end._end("done")
    right.close()


@pytest.mark.parametrize(
    "wrong", [{"sends": 0}, {"receives": 1177}, {"oldest": 0.0}, {"lease": float("nan")}, {"deaf": 61.0}]
)
def test_terms_that_cannot_be_kept_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Terms(**{"sends": 40, "receives": 24, "oldest": 0.05, **wrong})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "identity", [{"x" * 65: ""}, {"x": "y" * 65}, {"ü": ""}, {"x": "\n"}, {str(n): "" for n in range(65)}]
)
def test_what_is_compared_has_short_names_and_checksums(identity: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="at most 64 names"):
        Terms(sends=40, receives=24, oldest=0.05, identity=identity)


def test_a_difference_names_the_first_few_and_steers_no_terminal() -> None:
    assert difference({"a": "1"}, {"a": "1"}) == ""
    there = {f"{n}\x1b[2J": "2" * 100 for n in range(9)}
    said = difference({}, there)
    assert said.isprintable() and said.count("there") == 5 and said.endswith("4 more")
