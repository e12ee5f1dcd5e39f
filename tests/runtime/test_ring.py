"""The shared-memory ring keeps order, never blocks, and counts what it drops."""

import os

import numpy as np
import pytest
from hapticd.runtime.ring import CAPACITY, LONGEST_RECORD, Ring, RingError


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
