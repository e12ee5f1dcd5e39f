"""Recordings: MCAP files that hold everything a replay needs.

Channel ``tick`` carries the records of record.py with their structure as the schema, channel ``event`` the
sentences for people. Configuration and model are attachments; hashes and versions are in the metadata
record ``session``.
"""

from __future__ import annotations

import json
import platform
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from io import BufferedWriter
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.writer import CompressionType, Writer
from zstandard import ZstdError

from .config import Loaded, parse
from .errors import LogError, LogModelError, LogTruncatedError
from .forensics import LateTick
from .log_file import LogFile
from .record import Record, describe
from .record import parse as parse_record

LAYOUT_VERSION = "2"
CHUNK_BYTES = 64 << 10
"""Small chunks: a recording that is killed loses less than 100 ms."""
MAGIC = b"\x89MCAP0\r\n"
MAX_RECORD = 64 << 20
READ_ERRORS = (McapError, ZstdError, ValueError, LookupError, EOFError, OSError, RuntimeError, struct.error)
"""Everything that reading a damaged file may raise."""


class LogWriter:
    """Writes one recording."""

    def __init__(
        self, stream: LogFile, loaded: Loaded, hashes: dict[str, str], dtype: np.dtype[np.void], start_ns: int
    ) -> None:
        """``start_ns`` is the wall clock at tick 0 and only labels the file."""
        self._start_ns = start_ns
        self._period_ns = 1e9 / loaded.config.loop.rate
        self._file = stream
        self._stream = BufferedWriter(stream)
        self._writer = Writer(self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile="hapticd", library=f"hapticd {metadata.version('hapticd')}")
        session = {
            "layout": LAYOUT_VERSION,
            "config_name": loaded.source,
            "model_name": loaded.model_source,
            **{f"sha256_{name}": value for name, value in hashes.items()},
            **environment(),
        }
        self._writer.add_metadata("session", session)
        self._attach(loaded.source, "application/toml", loaded.text)
        self._attach(loaded.model_source, "application/xml", loaded.model_text)
        tick = self._writer.register_schema("hapticd.Tick", "numpy-dtype", describe(dtype).encode())
        event = self._writer.register_schema("hapticd.Event", "jsonschema", EVENT_SCHEMA.encode())
        self._tick = self._writer.register_channel("tick", "hapticd-record", tick)
        self._event = self._writer.register_channel("event", "json", event)
        late = self._writer.register_schema("hapticd.LateTick", "jsonschema", LATE_SCHEMA)
        self._late = self._writer.register_channel("late", "json", late)

    def tick(self, tick: int, record: bytes) -> None:
        """Append a record."""
        stamp = self._stamp(tick)
        self._writer.add_message(self._tick, stamp, record, stamp)

    def event(self, tick: int, text: str) -> None:
        """Append a sentence."""
        stamp = self._stamp(tick)
        self._writer.add_message(self._event, stamp, json.dumps({"tick": tick, "text": text}).encode(), stamp)

    def late(self, tick: int, late: bytes) -> None:
        """Append what is known of a late tick, as JSON."""
        stamp = self._stamp(tick)
        self._writer.add_message(self._late, stamp, late, stamp)

    @property
    def full(self) -> bool:
        """Whether the disk takes no more than the end of the recording."""
        return self._file.full is not None

    def finish(self, summary: str) -> None:
        """Complete the file, with the session's summary as JSON."""
        self._writer.add_metadata("summary", {"json": summary})
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.flush()

    def flush(self) -> None:
        """Hand what was written to the kernel; the last, unfinished chunk stays."""
        self._stream.flush()

    def _stamp(self, tick: int) -> int:
        return self._start_ns + round(tick * self._period_ns)

    def _attach(self, name: str, media_type: str, text: str) -> None:
        self._writer.add_attachment(self._start_ns, self._start_ns, name, media_type, text.encode())


EVENT_SCHEMA = json.dumps(
    {"type": "object", "properties": {"tick": {"type": "integer"}, "text": {"type": "string"}}}
)
LATE_SCHEMA = msgspec.json.encode(msgspec.json.schema(LateTick))


def environment() -> dict[str, str]:
    """What bit-for-bit equality of floating-point results depends on besides the code."""
    return {
        "cpu": _cpu(),
        "libc": " ".join(platform.libc_ver()),
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("hapticd", "numpy", "pin")},
    }


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "")


@dataclass(frozen=True, slots=True)
class Log:
    """An opened recording.

    Attributes:
        path: of the file.
        loaded: the configuration and model it was made with.
        hashes: of configuration, model and layout.
        session: all of its metadata.
        dtype: structure of the records' fixed part.
    """

    path: str
    loaded: Loaded
    hashes: dict[str, str]
    session: dict[str, str]
    dtype: np.dtype[np.void]

    def records(self) -> Iterator[Record]:
        """The ticks in order.

        Raises:
            LogError: a record is damaged.
        """
        for data in _messages(self.path, "tick"):
            record = parse_record(data, self.dtype)
            if record is None:
                raise LogError(self.path, "a record is damaged", "use another copy of the recording")
            yield record

    def events(self) -> Iterator[tuple[int, str]]:
        """Tick and sentence of every event."""
        for data in _messages(self.path, "event"):
            event = json.loads(data)
            yield int(event["tick"]), str(event["text"])


def open_log(path: str) -> Log:
    """Open a recording.

    Raises:
        LogTruncatedError: the file ends in the middle.
        LogModelError: made by another layout of this program, or inconsistent in itself.
        LogError: no recording, or damaged.
    """
    _require_whole(path)
    try:
        with open(path, "rb") as stream:
            reader = SeekingReader(stream, validate_crcs=True, record_size_limit=MAX_RECORD)
            summary = reader.get_summary()
            session = {
                k: v for m in reader.iter_metadata() if m.name == "session" for k, v in m.metadata.items()
            }
            attachments = {a.name: a.data.decode() for a in reader.iter_attachments()}
    except READ_ERRORS as error:
        raise LogError(path, f"cannot be read: {error}", "use another copy of the recording") from error
    if summary is None or not session:
        raise LogError(path, "is no recording of hapticd", "give a file that `hapticd run` wrote")
    if session.get("layout") != LAYOUT_VERSION:
        raise LogModelError(
            path,
            f"has record layout {session.get('layout')}, this program reads {LAYOUT_VERSION}",
            f"use hapticd {session.get('hapticd', 'of that time')}",
        )
    names = session["config_name"], session["model_name"]
    missing = [name for name in names if name not in attachments]
    if missing:
        raise LogError(path, f"lacks its attachment {missing[0]}", "use another copy of the recording")
    text, model = (attachments[name] for name in names)
    loaded = Loaded(path, parse(text, names[0]), text, names[0], model, names[1])
    schema = next((s for s in summary.schemas.values() if s.name == "hapticd.Tick"), None)
    if schema is None:
        raise LogError(path, "holds no ticks", "the session ended before its first tick")
    hashes = {k.removeprefix("sha256_"): v for k, v in session.items() if k.startswith("sha256_")}
    return Log(path, loaded, hashes, session, _dtype(path, schema.data))


def _require_whole(path: str) -> None:
    try:
        with open(path, "rb") as stream:
            head = stream.read(len(MAGIC))
            stream.seek(0, 2)
            size = stream.tell()
            stream.seek(max(0, size - len(MAGIC)))
            tail = stream.read(len(MAGIC))
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror}", "check the path") from error
    if head != MAGIC:
        raise LogError(path, "is no MCAP file", "give a file that `hapticd run` wrote")
    if tail != MAGIC or size < 2 * len(MAGIC):
        raise LogTruncatedError(
            path,
            f"ends in the middle, after {size} bytes",
            "use another copy; a running session is not complete yet",
        )


def _dtype(path: str, schema: bytes) -> np.dtype[np.void]:
    try:
        dtype: np.dtype[np.void] = np.dtype(_tuples(json.loads(schema)))
    except (ValueError, TypeError) as error:
        raise LogError(path, f"has a damaged schema: {error}", "use another copy of the recording") from error
    return dtype


def _tuples(descr: Any) -> Any:
    """JSON turned numpy's tuples into lists."""
    fields = []
    for name, kind, *shape in descr:
        fields.append((name, _tuples(kind) if isinstance(kind, list) else kind, *(tuple(s) for s in shape)))
    return fields


def _messages(path: str, topic: str) -> Iterator[bytes]:
    try:
        with open(path, "rb") as stream:
            reader = SeekingReader(stream, validate_crcs=True, record_size_limit=MAX_RECORD)
            for _, _, message in reader.iter_messages(topics=[topic], log_time_order=False):
                yield message.data
    except READ_ERRORS as error:
        raise LogError(path, f"is damaged: {error}", "use another copy of the recording") from error
