"""MCAP files of any origin, read forwards within fixed bounds of memory and work.

Nothing that such a file says about itself is believed: indexes are ignored, every length is compared with a
limit before anything is read or expanded, and checksums are compared where there are any
(https://mcap.dev/spec).
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import BinaryIO, NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, DataEnd, Metadata, Schema
from zstandard import ZstdDecompressor, ZstdError

from ..errors import LogError, LogTruncatedError

MAGIC = b"\x89MCAP0\r\n"
MAX_CHUNK = 4 << 20
"""As stored and expanded [bytes]; hapticd writes chunks of 64 KiB."""
MAX_RECORD = 1 << 20
"""Size of a record of any other kind [bytes]."""
MAX_WINDOW = 8 << 20
"""What a chunk may ask of the decompressor [bytes]."""
MAX_RATIO, ALLOWANCE = 200, 1 << 20
"""Expanded, the file so far may be this many times as long, and an allowance [bytes] longer; hapticd's own
records of a machine at rest have a ratio of 25."""
EACH = 96
"""What a record in a chunk counts for beside its length [bytes]: empty ones take time, too."""
MAX_COUNT = 16
"""Number of schemas, of channels, of attachments and of metadata records."""

_FRAME = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_CRC = struct.Struct("<I")


class Message(NamedTuple):
    """A message, as far as a log is made of it."""

    channel_id: int
    data: bytes


class Channel(NamedTuple):
    """A channel, as far as a log is made of it."""

    id: int
    schema_id: int
    topic: str


Item = Attachment | Channel | Message | Metadata | Schema
T = TypeVar("T")


class DamageError(Exception):
    """What is wrong with a record."""


def read(path: str) -> Iterator[Item]:
    """What a recording consists of, in the order of the file, chunks taken apart.

    Raises:
        LogTruncatedError: the file ends in the middle.
        LogError: it cannot be read, is not an MCAP file, is damaged, or goes beyond a limit.
    """
    at, crc = len(MAGIC), zlib.crc32(MAGIC)
    bounds = _Bounds()
    if os.path.exists(path) and not os.path.isfile(path):
        raise LogError(
            path, "is not a file", "give a file that `hapticd run` wrote"
        )  # a pipe would be waited for
    try:
        with open(path, "rb") as stream:
            _require_whole(path, stream)
            while True:
                head, content = _take(path, stream, at)
                if head[0] == Opcode.DATA_END:
                    _compare(_parse(DataEnd.read, content).data_section_crc, crc)
                    at += len(head) + len(content)
                    break
                bounds.grow(len(content))
                yield from _items(head[0], content, bounds)
                at += len(head) + len(content)
                crc = zlib.crc32(content, zlib.crc32(head, crc))
            while head[0] != Opcode.FOOTER:  # the index, which is not used here
                head, content = _take(path, stream, at)
                at += len(head) + len(content)
            if stream.read(len(MAGIC) + 1) != MAGIC:
                raise DamageError("something stands behind its end")
    except DamageError as error:
        raise LogError(
            path, f"is damaged at byte {at}: {error}", "use another copy of the recording"
        ) from error
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror}", "check the path") from error


class _Bounds:
    """How far a file may still expand, and what was counted of it."""

    def __init__(self) -> None:
        self._left = ALLOWANCE
        self._seen: set[tuple[int, object]] = set()

    def grow(self, stored: int) -> None:
        self._left += MAX_RATIO * stored

    def spend(self, size: int) -> None:
        self._left -= size
        if self._left < 0:
            raise DamageError(
                f"the file expands to more than {MAX_RATIO} times its length, or to too many records"
            )

    def count(self, opcode: int, key: object) -> None:
        self._seen.add((opcode, key))
        if sum(kind == opcode for kind, _ in self._seen) > MAX_COUNT:
            raise DamageError(f"more than {MAX_COUNT} records of kind {Opcode(opcode).name.lower()}")


def _require_whole(path: str, stream: BinaryIO) -> None:
    head, size = stream.read(len(MAGIC)), stream.seek(0, 2)
    if head != MAGIC:
        raise LogError(path, "is not an MCAP file", "give a file that `hapticd run` wrote")
    stream.seek(max(0, size - len(MAGIC)))
    if stream.read() != MAGIC or size < 2 * len(MAGIC):
        raise _cut_off(path, size)
    stream.seek(len(MAGIC))


def _cut_off(path: str, size: int) -> LogTruncatedError:
    fix = "use another copy; a running session is not complete yet"
    return LogTruncatedError(path, f"ends in the middle, after {size} bytes", fix)


def _take(path: str, stream: BinaryIO, at: int) -> tuple[bytes, bytes]:
    """Head and content of the next record, which is read only if it is short enough."""
    head = stream.read(_FRAME.size)
    if len(head) < _FRAME.size:
        raise _cut_off(path, at + len(head))
    opcode, length = _FRAME.unpack(head)
    limit = MAX_CHUNK if opcode == Opcode.CHUNK else MAX_RECORD
    if length > limit:
        raise DamageError(f"a record of {length} bytes; at most {limit} are read")
    content = stream.read(length)
    if len(content) < length:
        raise _cut_off(path, at + len(head) + len(content))
    return head, content


def _items(opcode: int, content: bytes, bounds: _Bounds) -> Iterator[Item]:
    """What a record of the file stands for; kinds that no log is made of are skipped."""
    match opcode:
        case Opcode.CHUNK:
            for inner, data in _split(_expand(_parse(Chunk.read, content), bounds)):
                bounds.spend(EACH)
                yield _inner(inner, data, bounds)
        case Opcode.MESSAGE | Opcode.CHANNEL | Opcode.SCHEMA:
            yield _inner(opcode, content, bounds)
        case Opcode.ATTACHMENT:
            attachment = _parse(Attachment.read, content)
            bounds.count(opcode, attachment.name)
            (crc,) = _CRC.unpack(content[-_CRC.size :])
            _compare(crc, zlib.crc32(content[: -_CRC.size]))
            yield attachment
        case Opcode.METADATA:
            metadata = _parse(Metadata.read, content)
            bounds.count(opcode, metadata.name)
            yield metadata


def _inner(opcode: int, content: bytes, bounds: _Bounds) -> Item:
    """What may be in a chunk: messages, channels, schemas."""
    if opcode == Opcode.MESSAGE:
        if len(content) < _MESSAGE.size:
            raise DamageError("a message without its head")
        return Message(_MESSAGE.unpack_from(content)[0], content[_MESSAGE.size :])
    if len(content) > MAX_RECORD:
        raise DamageError(f"a record of {len(content)} bytes; at most {MAX_RECORD} are read")
    if opcode == Opcode.CHANNEL:
        channel = _parse(_channel, content)
        bounds.count(opcode, channel.id)
        return channel
    if opcode == Opcode.SCHEMA:
        schema: Schema = _parse(Schema.read, content)
        bounds.count(opcode, schema.id)
        return schema
    raise DamageError(f"a record of kind {opcode} in a chunk")


def _expand(chunk: Chunk, bounds: _Bounds) -> bytes:
    size = chunk.uncompressed_size
    if size > MAX_CHUNK:
        raise DamageError(f"a chunk of {size} bytes; at most {MAX_CHUNK} are read")
    bounds.spend(size)
    match chunk.compression:
        case "":
            data = chunk.data
        case "zstd":
            try:
                with ZstdDecompressor(max_window_size=MAX_WINDOW).stream_reader(chunk.data) as expanded:
                    data = expanded.read(size + 1)
            except ZstdError as error:
                raise DamageError(str(error)) from error
        case other:
            raise DamageError(f"a chunk is compressed with {other[:20]!r}; hapticd reads and writes zstd")
    if len(data) != size:
        raise DamageError(f"a chunk has another length than the {size} bytes that it names")
    _compare(chunk.uncompressed_crc, zlib.crc32(data))
    return data


def _split(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of the records in a chunk."""
    at, end = 0, len(data)
    while at < end:
        start = at + _FRAME.size
        if start > end:
            raise DamageError("a chunk ends in the middle of a record")
        opcode, length = _FRAME.unpack_from(data, at)
        at = start + length
        if at > end:
            raise DamageError("a record reaches beyond its chunk")
        yield opcode, data[start:at]


def _channel(stream: ReadDataStream) -> Channel:
    return Channel(stream.read2(), stream.read2(), stream.read_prefixed_string())


def _parse(kind: Callable[[ReadDataStream], T], content: bytes) -> T:
    try:
        return kind(ReadDataStream(BytesIO(content)))
    except (McapError, ValueError, OverflowError, struct.error) as error:
        raise DamageError("a record that does not hold what its kind asks for") from error


def _compare(expected: int, actual: int) -> None:
    """0 stands for no checksum."""
    if expected not in (0, actual):
        raise DamageError(f"its checksum is {actual:08x} instead of {expected:08x}")
