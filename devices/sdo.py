"""SDO client, sans-IO: generators that yield the request to send and are sent the device's response.

Expedited and segmented transfers, both ways. A generator returns what it read (or None) and raises
`SdoError`; deadlines are its driver's business, because only that one counts ticks.
"""

from __future__ import annotations

import struct
from collections.abc import Generator
from typing import Final

from canopen.sdo.constants import (
    EXPEDITED,
    NO_MORE_DATA,
    REQUEST_DOWNLOAD,
    REQUEST_SEGMENT_DOWNLOAD,
    REQUEST_SEGMENT_UPLOAD,
    REQUEST_UPLOAD,
    RESPONSE_ABORTED,
    RESPONSE_DOWNLOAD,
    RESPONSE_SEGMENT_DOWNLOAD,
    RESPONSE_SEGMENT_UPLOAD,
    RESPONSE_UPLOAD,
    SDO_STRUCT,
    SIZE_SPECIFIED,
    TOGGLE_BIT,
)

from .errors import SdoAbortError, SdoProtocolError

LENGTH: Final = 8
MAX_TRANSFER: Final = 4096  # bytes; more than any object of a start-up sequence

_SPECIFIER: Final = 0xE0
_SEGMENT: Final = 7
_EXPEDITED_MAX: Final = 4


def upload(
    node: int, index: int, subindex: int, size: int = _EXPEDITED_MAX
) -> Generator[bytes, bytes, bytes]:
    """Reads an object.

    Args:
        node: node id of the device.
        index: of the object.
        subindex: of the object.
        size: bytes that the object has, for a server that leaves the size of an expedited answer out.

    Raises:
        SdoAbortError: the device refused.
        SdoProtocolError: the device broke the protocol.
    """
    where = (node, index, subindex)
    response = yield _initiate(REQUEST_UPLOAD, index, subindex, bytes(4))
    command = _check_initiate(response, RESPONSE_UPLOAD, where)
    if command & EXPEDITED:
        said = _EXPEDITED_MAX - (command >> 2 & 3) if command & SIZE_SPECIFIED else size
        return response[4 : 4 + said]
    announced = struct.unpack_from("<I", response, 4)[0] if command & SIZE_SPECIFIED else None
    data = bytearray()
    toggle = 0
    while True:
        response = yield bytes([REQUEST_SEGMENT_UPLOAD | toggle]) + bytes(7)
        command = _check_segment(response, RESPONSE_SEGMENT_UPLOAD, toggle, where)
        data += response[1 : 1 + _SEGMENT - (command >> 1 & 7)]
        if len(data) > MAX_TRANSFER:
            raise SdoProtocolError(*where, f"sent more than {MAX_TRANSFER} bytes")
        if command & NO_MORE_DATA:
            break
        toggle ^= TOGGLE_BIT
    if announced is not None and announced != len(data):
        raise SdoProtocolError(*where, f"announced {announced} bytes and sent {len(data)}")
    return bytes(data)


def download(node: int, index: int, subindex: int, data: bytes) -> Generator[bytes, bytes, None]:
    """Writes an object.

    Raises:
        SdoAbortError: the device refused.
        SdoProtocolError: the device broke the protocol.
    """
    where = (node, index, subindex)
    if 0 < len(data) <= _EXPEDITED_MAX:
        command = REQUEST_DOWNLOAD | EXPEDITED | SIZE_SPECIFIED | (_EXPEDITED_MAX - len(data)) << 2
        response = yield _initiate(command, index, subindex, data.ljust(4, b"\0"))
        _check_initiate(response, RESPONSE_DOWNLOAD, where)
        return
    size = struct.pack("<I", len(data))
    response = yield _initiate(REQUEST_DOWNLOAD | SIZE_SPECIFIED, index, subindex, size)
    _check_initiate(response, RESPONSE_DOWNLOAD, where)
    toggle = 0
    for start in range(0, max(1, len(data)), _SEGMENT):
        segment = data[start : start + _SEGMENT]
        last = NO_MORE_DATA if start + _SEGMENT >= len(data) else 0
        command = REQUEST_SEGMENT_DOWNLOAD | toggle | (_SEGMENT - len(segment)) << 1 | last
        response = yield bytes([command]) + segment.ljust(_SEGMENT, b"\0")
        _check_segment(response, RESPONSE_SEGMENT_DOWNLOAD, toggle, where)
        toggle ^= TOGGLE_BIT


def address_of(request: bytes) -> tuple[int, int] | None:
    """Index and sub-index of a request that begins a transfer; None for one that continues it."""
    if request[0] & _SPECIFIER in (REQUEST_UPLOAD, REQUEST_DOWNLOAD):
        _, index, subindex = SDO_STRUCT.unpack_from(request)
        return index, subindex
    return None


def _initiate(command: int, index: int, subindex: int, rest: bytes) -> bytes:
    return SDO_STRUCT.pack(command, index, subindex) + rest


def _check_abort(response: bytes, where: tuple[int, int, int]) -> int:
    command = response[0]
    if command & _SPECIFIER == RESPONSE_ABORTED:
        raise SdoAbortError(*where, struct.unpack_from("<I", response, 4)[0])
    return command


def _check_initiate(response: bytes, expected: int, where: tuple[int, int, int]) -> int:
    command = _check_abort(response, where)
    if command & _SPECIFIER != expected or SDO_STRUCT.unpack_from(response)[1:] != where[1:]:
        raise SdoProtocolError(*where, f"unexpected response {response.hex(' ')}")
    return command


def _check_segment(response: bytes, expected: int, toggle: int, where: tuple[int, int, int]) -> int:
    command = _check_abort(response, where)
    if command & _SPECIFIER != expected:
        raise SdoProtocolError(*where, f"unexpected response {response.hex(' ')}")
    if command & TOGGLE_BIT != toggle:
        raise SdoProtocolError(*where, "the toggle bit did not alternate")
    return command
