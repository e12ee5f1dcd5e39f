"""The shared-memory ring keeps order, never blocks, and counts what it drops."""

import os

import numpy as np
import pytest
from hapticd.runtime.configuration.config import load
from hapticd.runtime.configuration.known import built_in
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.runtime.recording.record import NO_TIMING, RecordWriter
from hapticd.runtime.recording.ring import CAPACITY, LONGEST_RECORD, Drain, Ring, RingError

LENGTH, SPACE = 60_000, 60_008
"""Size of a record: its bytes, and what it takes with its length in front and padded to eights."""


def test_records_come_out_as_they_went_in_across_many_turns_of_the_ring() -> None:
    ring = Ring.create()
    other = Ring.attach(ring.fd)
    rng = np.random.default_rng(1)
    pushed = popped = 0
    waiting: list[bytes] = []
    while pushed < 3 * CAPACITY:
        for _ in range(int(rng.integers(1, 60))):
            record = rng.bytes(int(rng.integers(1, 3000)))
            assert ring.push(record)
            waiting.append(record)
            pushed += len(record)
        for _ in range(int(rng.integers(1, len(waiting) + 1))):
            record = waiting.pop(0)
            assert other.pop() == record
            popped += 1
    assert ring.dropped == 0
    assert popped > 5000


def test_a_full_ring_drops_new_records_and_counts_them() -> None:
    ring = Ring.create()
    record = bytes(60_000)
    kept = 0
    while ring.push(record):
        kept += 1
    assert kept * len(record) > 0.98 * CAPACITY
    assert not ring.push(record)
    assert ring.dropped == 2
    other = Ring.attach(ring.fd)
    assert other.pop() == record
    assert ring.push(record)
    for _ in range(kept):
        assert other.pop() == record
    assert other.pop() is None


def test_what_is_left_over_at_the_end_of_the_ring_is_no_room() -> None:
    ring = Ring.create()
    first, longer, last = b"a" * LENGTH, b"b" * (LENGTH + 8), b"c" * LENGTH
    kept = 0
    while ring.push(first):
        kept += 1
    assert 8 <= CAPACITY - kept * SPACE < SPACE  # left over
    assert ring.pop() == first
    # there are bytes enough for the longer one, but not in one piece
    assert not ring.push(longer)
    assert ring.push(last)
    for _ in range(kept - 1):
        assert ring.pop() == first
    assert ring.pop() == last
    assert ring.pop() is None


def test_memory_that_holds_no_ring_is_refused() -> None:
    fd = os.memfd_create("other")
    with pytest.raises(RingError, match="empty"):
        Ring.attach(fd)
    os.ftruncate(fd, 1 << 16)
    with pytest.raises(RingError, match="no ring"):
        Ring.attach(fd)
    os.close(fd)


def test_a_damaged_length_is_an_error_and_no_crash() -> None:
    ring = Ring.create()
    ring.push(b"x" * 100)
    at = ring._map.find(b"x" * 100) - 4
    ring._map[at : at + 4] = (LONGEST_RECORD * 2).to_bytes(4, "little")
    with pytest.raises(RingError, match="damaged"):
        ring.pop()


def test_a_reader_that_takes_nothing_out_is_stuck_and_one_that_has_nothing_to_take_is_not() -> None:
    ring = Ring.create()
    other, drain = Ring.attach(ring.fd), Drain(ring, patience=3)
    assert not any(drain.stuck() for _ in range(10))  # empty
    ring.push(b"a")
    assert [drain.stuck() for _ in range(4)] == [False, False, True, True]
    assert (ring.read, ring.unread) == (0, 8)
    ring.push(b"b")
    assert drain.stuck()
    other.pop()
    assert [drain.stuck() for _ in range(4)] == [False, False, False, True]  # slow, but it read
    other.pop()
    assert (ring.read, ring.unread) == (16, 0)
    assert not any(drain.stuck() for _ in range(10))


def test_a_reader_that_keeps_the_ring_full_but_reads_is_not_stuck() -> None:
    ring = Ring.create()
    other, drain = Ring.attach(ring.fd), Drain(ring, patience=2)
    while ring.push(bytes(LENGTH)):
        pass
    for _ in range(300):
        assert other.pop() is not None
        assert ring.push(bytes(LENGTH))
        assert not drain.stuck()


def test_a_ring_has_the_room_that_is_asked_for() -> None:
    ring = Ring.create(3 * CAPACITY + 3)
    other = Ring.attach(ring.fd)
    kept = 0
    while ring.push(bytes(LENGTH)):
        kept += 1
    assert kept * SPACE > 3 * CAPACITY - SPACE
    for _ in range(kept):
        assert other.pop() == bytes(LENGTH)


@pytest.mark.parametrize("machine", built_in())
def test_the_ring_is_sized_by_no_less_than_what_the_ticks_of_a_machine_bring(machine: str) -> None:
    bench = Lockstep(build(load(machine)))
    writer = RecordWriter(bench.session.cycle)
    longest = 0
    for _ in range(600):
        bench.tick()
        longest = max(longest, len(writer.write(bench.inputs, NO_TIMING)))
    assert bench.session.cycle.mode is not Mode.BRINGUP
    assert 0 < longest <= writer.usual_bytes
