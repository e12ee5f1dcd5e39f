"""What can happen to the frames of a device; `node.tamper = drop(3)`.

Each returns a function that is given every frame the device sends and says what becomes of it.
"""

from __future__ import annotations

from collections.abc import Iterator

from .node import Tamper


def drop(count: int) -> Tamper:
    """The next `count` frames are lost."""

    def fault(can_id: int, data: bytes) -> Iterator[tuple[int, bytes]]:
        nonlocal count
        count -= 1
        if count < 0:
            yield can_id, data

    return fault


def duplicate(count: int) -> Tamper:
    """The next `count` frames arrive twice."""

    def fault(can_id: int, data: bytes) -> Iterator[tuple[int, bytes]]:
        nonlocal count
        count -= 1
        yield can_id, data
        if count >= 0:
            yield can_id, data

    return fault


def corrupt(count: int, byte: int, mask: int) -> Tamper:
    """The next `count` frames arrive with the bits of `mask` flipped in one byte."""

    def fault(can_id: int, data: bytes) -> Iterator[tuple[int, bytes]]:
        nonlocal count
        count -= 1
        if count >= 0 and byte < len(data):
            data = data[:byte] + bytes([data[byte] ^ mask]) + data[byte + 1 :]
        yield can_id, data

    return fault


def truncate(count: int) -> Tamper:
    """The next `count` frames arrive without their last byte: a wrong DLC."""

    def fault(can_id: int, data: bytes) -> Iterator[tuple[int, bytes]]:
        nonlocal count
        count -= 1
        yield can_id, data[:-1] if count >= 0 else data

    return fault


def delay(count: int) -> Tamper:
    """The next `count` frames are held back until the frame after each of them."""
    held: list[tuple[int, bytes]] = []

    def fault(can_id: int, data: bytes) -> Iterator[tuple[int, bytes]]:
        nonlocal count
        count -= 1
        yield from held
        held.clear()
        if count >= 0:
            held.append((can_id, data))
        else:
            yield can_id, data

    return fault
