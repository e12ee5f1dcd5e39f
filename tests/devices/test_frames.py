from __future__ import annotations

import numpy as np
import pytest
from hapticd.devices.errors import FrameError
from hapticd.devices.frames import FRAME, Frames, padded_length


def test_a_frame_is_laid_out_like_struct_canfd_frame() -> None:
    frames = Frames()
    frames.append(0x181, b"\x01\x02\x03")
    assert FRAME.itemsize == 72
    assert frames.array.tobytes() == b"\x81\x01\x00\x00\x03\x01\x00\x00\x01\x02\x03" + bytes(61)


def test_payloads_are_padded_to_lengths_that_can_fd_has() -> None:
    sizes = [0, 8, 9, 13, 17, 22, 29, 33, 49, 64]
    assert [padded_length(n) for n in sizes] == [0, 8, 12, 16, 20, 24, 32, 48, 64, 64]
    with pytest.raises(FrameError, match="65 bytes"):
        padded_length(65)


def test_frames_come_back_as_they_were_appended() -> None:
    frames = Frames()
    for can_id, data in ((0x080, b""), (0x7FF, bytes(64)), (0x601, b"\x40\x18\x10\x01\0\0\0\0")):
        frames.append(can_id, data)
    assert list(frames) == [(0x080, b""), (0x7FF, bytes(64)), (0x601, b"\x40\x18\x10\x01\0\0\0\0")]
    assert frames[1] == (0x7FF, bytes(64))
    with pytest.raises(IndexError):
        frames[3]


def test_a_full_buffer_and_an_oversize_payload_are_refused() -> None:
    frames = Frames(capacity=2)
    frames.append(1, b"")
    frames.append(2, b"")
    with pytest.raises(FrameError, match="no room for more than 2"):
        frames.append(3, b"")
    with pytest.raises(FrameError, match="65 bytes"):
        Frames().append(1, bytes(65))
    more = Frames()
    more.append(3, b"")
    with pytest.raises(FrameError, match="no room"):
        frames.extend(more)
    assert [can_id for can_id, _ in frames] == [1, 2]


def test_packed_frames_have_the_documented_bytes() -> None:
    frames = Frames()
    frames.append(0x080, b"\x05\x00\x01\x00")
    frames.append(0x185, b"")
    assert frames.pack() == b"\x80\0\0\0\x04\x01\x05\x00\x01\x00" + b"\x85\x01\0\0\x00\x01"


def test_packing_and_unpacking_is_an_exact_round_trip() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        frames = Frames()
        for _ in range(rng.integers(0, 65)):
            frames.append(int(rng.integers(0, 2**32)), rng.bytes(int(rng.integers(0, 65))))
        frames.array["flags"] = rng.integers(0, 256, len(frames))
        again = Frames()
        again.append(1, b"old contents")
        again.unpack(frames.pack())
        assert again.array.tobytes() == frames.array.tobytes()


@pytest.mark.parametrize(
    ("packed", "why"),
    [
        (b"\x80\0\0", "end inside a frame"),
        (b"\x80\0\0\0\x04\x01\x05\x00\x01", "end inside a frame"),
        (b"\x80\0\0\0\x41\x01" + bytes(65), "more than 64 bytes"),
        (b"\x80\0\0\0\0\0" * 65, "more frames than the buffer holds"),
    ],
)
def test_bytes_that_are_no_frames_raise_a_typed_error(packed: bytes, why: str) -> None:
    frames = Frames()
    frames.append(1, b"")
    with pytest.raises(FrameError, match=why):
        frames.unpack(packed)
    assert len(frames) == 0


def test_random_bytes_never_crash_unpacking() -> None:
    rng = np.random.default_rng(2)
    frames = Frames()
    for _ in range(2000):
        packed = rng.bytes(int(rng.integers(0, 300)))
        try:
            frames.unpack(packed)
        except FrameError:
            continue
        assert frames.pack() == packed


def test_answers_are_counted_by_their_identifiers() -> None:
    frames = Frames()
    assert frames.answers == 0
    for can_id in (0x180, 0x181, 0x1FF, 0x200, 0x701, 0x081, 0x581, 0x190):
        frames.append(can_id, b"")
    assert frames.answers == 3


def test_taking_frames_empties_where_they_were_or_changes_nothing() -> None:
    here, there, small = Frames(), Frames(), Frames(1)
    here.append(0x99, b"old")
    there.append(0x181, b"one")
    there.append(0x182, b"two")
    with pytest.raises(FrameError, match="no room for more than 1 frames"):
        small.take(there)
    assert (len(small), len(there)) == (0, 2)
    assert here.take(there) == 2
    assert list(here) == [(0x181, b"one"), (0x182, b"two")] and len(there) == 0
    assert here.take(there) == 0 == len(here)
