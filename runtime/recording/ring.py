"""The shared-memory ring between the real-time process and the recorder."""

from __future__ import annotations

import mmap
import os

from .._rt import ffi, lib
from ..errors import HapticdError

CAPACITY = 8 << 20
"""Bytes, at the least."""
LONGEST_RECORD = 1 << 16


class RingError(HapticdError):
    """Shared memory that is not a ring, or a damaged one."""

    code = "ring"


class Ring:
    """One end of the ring; exactly one process pushes and one pops.

    Attributes:
        fd: of the shared memory, to be inherited by the other process.
    """

    def __init__(self, fd: int, size: int, capacity: int = 0) -> None:
        self.fd = fd
        self._map = mmap.mmap(fd, size)
        self._ring = ffi.cast("ring *", ffi.from_buffer(self._map))
        if capacity:
            lib.ring_init(self._ring, capacity)
        elif not lib.ring_valid(self._ring, size):
            raise RingError("the shared memory holds no ring")
        self._record = ffi.new("char[]", LONGEST_RECORD)
        self._view = ffi.buffer(self._record)

    @classmethod
    def create(cls, room: int = CAPACITY) -> Ring:
        """A new ring in anonymous shared memory, with room for so many bytes."""
        capacity = -(-max(room, CAPACITY) // 8) * 8
        fd = os.memfd_create("hapticd-ring", os.MFD_CLOEXEC)
        size = int(lib.ring_size(capacity))
        os.ftruncate(fd, size)
        return cls(fd, size, capacity)

    @classmethod
    def attach(cls, fd: int) -> Ring:
        """The other end of an inherited ring.

        Raises:
            RingError: the descriptor is something else.
        """
        size = os.fstat(fd).st_size
        if size == 0:
            raise RingError("the shared memory is empty")
        return cls(fd, size)

    @property
    def dropped(self) -> int:
        """Records that did not fit."""
        return int(lib.ring_dropped(self._ring))

    @property
    def read(self) -> int:
        """Bytes that were ever taken out."""
        return int(lib.ring_read(self._ring))

    @property
    def room(self) -> int:
        """Bytes of it that records may take, but for a few."""
        return len(self._map)

    @property
    def unread(self) -> int:
        """Bytes that wait to be taken out."""
        return int(lib.ring_unread(self._ring))

    def push(self, record: bytes) -> bool:
        """Store a record; False, and it is counted, where there is no room."""
        return bool(lib.ring_push(self._ring, record, len(record)))

    def pop(self) -> bytes | None:
        """The oldest record, None where the ring is empty.

        Raises:
            RingError: the memory is damaged.
        """
        length = int(lib.ring_pop(self._ring, self._record, LONGEST_RECORD))
        if length < 0:
            raise RingError("the ring is damaged")
        return self._view[:length] if length else None


class Drain:
    """Watches whether the other end of a ring takes out what is put in."""

    def __init__(self, ring: Ring, patience: int) -> None:
        """Looks in a row, all of them at a ring that is not empty, without anything taken out in between."""
        self._ring, self._patience = ring, patience
        self._read, self._looks = ring.read, 0

    def stuck(self) -> bool:
        """One look: whether nothing was taken out for as many looks as it has patience."""
        read = self._ring.read
        idle = read == self._read and self._ring.unread > 0
        self._looks = self._looks + 1 if idle else 0
        self._read = read
        return self._looks >= self._patience
