"""A buffer of CAN FD frames, and their compact form for the log."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..binding import bind, pointer
from ._wire import ffi, lib
from .cia301 import MAX_NODE, TPDO
from .errors import FrameError

FRAME = np.dtype([("id", "<u4"), ("len", "u1"), ("flags", "u1"), ("reserved", "u1", 2), ("data", "u1", 64)])
CAPACITY = 64
MAX_DATA = int(lib.WIRE_DATA)

_FD_LENGTHS: tuple[int, ...] = (*range(9), 12, 16, 20, 24, 32, 48, 64)
_PACKED_HEADER = 6
_ID_LEN = struct.Struct("<IB")
_DATA_OFFSET = 8
_UNPACK_ERRORS = {
    lib.WIRE_TRUNCATED: "the bytes end inside a frame",
    lib.WIRE_BAD_LENGTH: "a frame claims more than 64 bytes",
    lib.WIRE_FULL: "there are more frames than the buffer holds",
}


def padded_length(size: int) -> int:
    """The shortest CAN FD payload that holds `size` bytes.

    Raises:
        FrameError: `size` is more than 64 bytes.
    """
    length = next((n for n in _FD_LENGTHS if n >= size), None)
    if length is not None:
        return length
    raise FrameError(f"{size} bytes do not fit into a CAN FD frame, which holds 64")


class Frames:
    """Up to `capacity` frames, as adapters fill them and the cycle reads and writes them.

    Attributes:
        pointer: the C view, `wire_frames *`, bound once.
    """

    __slots__ = ("_array", "_bytes", "_packed", "_packed_pointer", "pointer")

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._array = np.zeros(capacity, FRAME)
        self._bytes = self._array.view(np.uint8).reshape(-1).data
        packed = np.zeros(capacity * (_PACKED_HEADER + MAX_DATA), np.uint8)
        self._packed, self._packed_pointer = packed.data, pointer(packed, "uint8_t", packed.size)
        self.pointer = ffi.new("wire_frames *", {"capacity": capacity})
        bind(lib, self.pointer, frame=self._array)

    def __len__(self) -> int:
        return int(self.pointer.count)

    def __iter__(self) -> Iterator[tuple[int, bytes]]:
        """Identifier and payload of each frame."""
        for start in range(0, self.pointer.count * FRAME.itemsize, FRAME.itemsize):
            yield self._frame(start)

    def __getitem__(self, i: int) -> tuple[int, bytes]:
        if not 0 <= i < self.pointer.count:
            raise IndexError(i)
        return self._frame(i * FRAME.itemsize)

    @property
    def array(self) -> NDArray[np.void]:
        """The frames in use, (count,) of `FRAME`; a view."""
        return self._array[: self.pointer.count]

    @property
    def answers(self) -> int:
        """How many of them are TPDOs, by their identifiers."""
        return int(lib.wire_count(self.pointer, TPDO + 1, TPDO + MAX_NODE))

    def count(self, can_id: int) -> int:
        """How many of them have this identifier."""
        return int(lib.wire_count(self.pointer, can_id, can_id))

    def clear(self) -> None:
        """Forgets all frames."""
        self.pointer.count = 0

    def append(self, can_id: int, data: bytes) -> None:
        """Adds a frame, to be sent with the fast bit rate.

        Raises:
            FrameError: the buffer is full, or `data` is longer than 64 bytes.
        """
        if lib.wire_append(self.pointer, can_id, data, len(data)):
            raise FrameError(
                f"{len(data)} bytes do not fit into a frame"
                if len(data) > MAX_DATA
                else f"no room for more than {self.pointer.capacity} frames in a tick"
            )

    def extend(self, other: Frames) -> None:
        """Adds all frames of `other`, unless there is no room for all of them.

        Raises:
            FrameError: no room.
        """
        if lib.wire_extend(self.pointer, other.pointer, 0):
            raise FrameError(f"no room for more than {self.pointer.capacity} frames in a tick")

    def take(self, other: Frames) -> int:
        """Replaces the contents by those of `other`, which is empty then; returns how many.

        Raises:
            FrameError: no room; both are as they were.
        """
        taken = int(lib.wire_take(self.pointer, other.pointer))
        if taken < 0:
            raise FrameError(f"no room for more than {self.pointer.capacity} frames in a tick")
        return taken

    def pack(self) -> bytes:
        """The frames as bytes for the log: per frame id (4, little endian), len, flags, data[len]."""
        return self._packed[: lib.wire_pack(self.pointer, self._packed_pointer)].tobytes()

    def _frame(self, start: int) -> tuple[int, bytes]:
        can_id, length = _ID_LEN.unpack_from(self._bytes, start)
        data = start + _DATA_OFFSET
        return can_id, self._bytes[data : data + length].tobytes()

    def unpack(self, packed: bytes) -> None:
        """Replaces the contents by what `pack` gave.

        Raises:
            FrameError: truncated or impossible bytes, or more frames than the buffer holds.
        """
        result = lib.wire_unpack(self.pointer, packed, len(packed))
        if result < 0:
            raise FrameError(f"cannot unpack {len(packed)} bytes into frames: {_UNPACK_ERRORS[result]}")
