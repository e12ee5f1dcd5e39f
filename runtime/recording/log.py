"""Recordings: MCAP files that hold everything a replay needs.

Channel ``tick`` carries the records of record.py with their structure as the schema, channel ``event`` the
events of core/events.py with what people read of them. Configuration, model and the EDS files that do not
come with this program are attachments; hashes and versions are in the metadata record ``session``, which EDS
a device has in ``eds``.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from io import BufferedWriter
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from mcap.records import Attachment, Metadata, Schema
from mcap.writer import CompressionType, Writer

from ...devices.device import Device
from ...devices.dictionary import KeptEds, built_in, text_of
from ..configuration.config import Loaded, parse
from ..core.events import Event, Severity, Value
from ..errors import ConfigError, LogError, LogModelError
from ..timing.forensics import LateTick
from .log_file import LogFile, LogWriteError
from .reader import MAX_COUNT, MAX_RECORD, Channel, Message, read
from .record import HEAD, Record, describe
from .record import parse as parse_record

LAYOUT_VERSION = "3"
CHUNK_BYTES = 64 << 10
"""Small chunks: a recording that is killed loses less than 100 ms."""
EDS = "eds/"
"""What the names of attachments that are EDS files begin with."""
MAX_EDS = MAX_COUNT - 2
"""Different ones in a recording: besides configuration and model."""
MAX_TEXT = 1000
"""Length of a name or value in a session's metadata [characters]."""


class LogWriter:
    """Writes one recording."""

    def __init__(
        self, stream: LogFile, loaded: Loaded, hashes: dict[str, str], dtype: np.dtype[np.void], start_ns: int
    ) -> None:
        """``start_ns`` is the wall clock at tick 0 and only labels the file.

        Raises:
            LogWriteError: more EDS files than a recording can keep.
        """
        eds = _own_eds(loaded.config.devices)
        names = {text: f"{EDS}{k}" for k, text in enumerate(dict.fromkeys(eds.values()), 1)}
        if len(names) > MAX_EDS:
            raise LogWriteError(f"a recording keeps {MAX_EDS} EDS files; these devices have {len(names)}")
        self._start_ns = start_ns
        self._period_ns = 1e9 / loaded.config.loop.rate
        self._file = stream
        self._stream = BufferedWriter(stream)
        self._writer = Writer(
            self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD, enable_data_crcs=True
        )
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
        if names:
            self._writer.add_metadata("eds", {name: names[text] for name, text in eds.items()})
        for text, name in names.items():
            self._attach(name, "text/plain", text)
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

    def event(self, tick: int, event: Event) -> None:
        """Append what happened."""
        stamp = self._stamp(tick)
        logged = LoggedEvent(tick, str(event), event.code, event.severity, event.values)
        self._writer.add_message(self._event, stamp, msgspec.json.encode(logged), stamp)

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


def _own_eds(devices: Mapping[str, Device]) -> dict[str, str]:
    """Text by device of the EDS files that, where the recording is replayed, may be others, or gone."""
    return {name: text_of(device.eds) for name, device in devices.items() if not built_in(device.eds)}


TEXT_SCHEMA = json.dumps(
    {"type": "object", "properties": {"tick": {"type": "integer"}, "text": {"type": "string"}}}
)
"""Schema of events in recordings that keep only their words."""
EVENT_SCHEMA = json.dumps(
    {
        "type": "object",
        "properties": {
            "tick": {"type": "integer"},
            "text": {"type": "string"},
            "code": {"type": "string"},
            "severity": {"type": "string"},
            "values": {"type": "object"},
        },
    }
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
        schema: text that describes the records' fixed part; dtype: its structure.
    """

    path: str
    loaded: Loaded
    hashes: dict[str, str]
    session: dict[str, str]
    schema: bytes
    dtype: np.dtype[np.void]

    @property
    def its_version(self) -> str:
        """What to do with a recording that this version cannot use."""
        return _use_its_version(self.session)

    def records(self) -> Iterator[Record]:
        """The ticks in order.

        Raises:
            LogError: a record is damaged.
        """
        for data in _messages(self.path, "tick", (self.schema,)):
            record = parse_record(data, self.dtype)
            if record is None:
                raise _damaged(self.path, "a record is not as long as it says")
            yield record

    def events(self) -> Iterator[LoggedEvent]:
        """Every event.

        Raises:
            LogError: an event, or the file, is damaged.
        """
        for data in _messages(self.path, "event", (EVENT_SCHEMA.encode(), TEXT_SCHEMA.encode())):
            try:
                event = msgspec.json.decode(data, type=LoggedEvent)
            except (msgspec.MsgspecError, ValueError) as error:
                raise _damaged(self.path, f"an event cannot be read: {error}") from error
            yield event

    def late_ticks(self) -> Iterator[LateTick]:
        """What is known of every tick that was late.

        Raises:
            LogError: one of them, or the file, is damaged.
        """
        for data in _messages(self.path, "late", (LATE_SCHEMA,)):
            try:
                late = msgspec.json.decode(data, type=LateTick)
            except (msgspec.MsgspecError, ValueError) as error:
                raise _damaged(self.path, f"what it says of a late tick cannot be read: {error}") from error
            yield late


class LoggedEvent(msgspec.Struct, frozen=True):
    """An event as the log keeps it; see ``Event``.

    Attributes:
        tick: that it is about.
        text: what people read.
        code, severity, values: of the event; empty or None where the recording keeps nothing but the words.
    """

    tick: int
    text: str
    code: str = ""
    severity: Severity | None = None
    values: dict[str, Value] = {}


def open_log(path: str) -> Log:
    """Open a recording; of the file only what precedes the first tick is read.

    Raises:
        LogTruncatedError: the file ends in the middle.
        LogModelError: made by another layout of this program, or with a configuration that is refused here.
        LogError: no recording, or damaged.
    """
    session: dict[str, str] = {}
    texts: dict[str, str] = {}
    eds: dict[str, str] = {}
    schema: bytes | None = None
    for item in read(path):
        match item:
            case Metadata(name="session"):
                if session:
                    raise _damaged(path, "it describes two sessions")
                session = _require_session(path, item.metadata)
            case Metadata(name="eds"):
                if eds:
                    raise _damaged(path, "it says twice which EDS files it keeps")
                eds = item.metadata
            case Attachment() if item.name in (*_names(session), *eds.values()):
                if item.name in texts:
                    raise _damaged(path, f"it holds two attachments {item.name}")
                texts[item.name] = _text(path, item)
            case Schema(name="hapticd.Tick"):
                schema = item.data
            case Message():
                break
    if not session:
        raise LogError(path, "is not a recording of hapticd", "give a file that `hapticd run` wrote")
    names = _names(session)
    missing = [name for name in (*names, *eds.values()) if name not in texts]
    if missing:
        raise LogError(path, f"lacks its attachment {missing[0]}", "use another copy of the recording")
    if schema is None:
        raise LogError(path, "holds no ticks", "the session ended before its first tick")
    text, model = (texts[name] for name in names)
    try:
        config = parse(text, f"{names[0]} in {path}")
    except ConfigError as error:
        raise LogModelError(
            path, f"keeps a configuration that is refused here:\n{error}\n", _use_its_version(session)
        ) from error
    devices = dict(config.devices)
    for name, attachment in eds.items():
        if name not in devices:
            raise _damaged(path, "it keeps the EDS of a device that its configuration does not have")
        kept = KeptEds(devices[name].eds, texts[attachment])
        devices[name] = msgspec.structs.replace(devices[name], eds=kept)
    config = msgspec.structs.replace(config, devices=devices)
    loaded = Loaded(path, config, text, names[0], model, names[1])
    hashes = {k.removeprefix("sha256_"): v for k, v in session.items() if k.startswith("sha256_")}
    dtype = _dtype(path, schema, _use_its_version(session))
    return Log(path, loaded, hashes, session, schema, dtype)


def _require_session(path: str, session: dict[str, str]) -> dict[str, str]:
    """Metadata that may be shown to a person and that name layout, configuration and model."""
    if not all(len(text) <= MAX_TEXT and text.isprintable() for pair in session.items() for text in pair):
        raise _damaged(path, "its session record holds what is not a line of text")
    if session.get("layout") != LAYOUT_VERSION:
        raise LogModelError(
            path,
            f"has record layout {session.get('layout')}, this program reads {LAYOUT_VERSION}",
            _use_its_version(session),
        )
    for name in ("config_name", "model_name"):
        if name not in session:
            raise _damaged(path, f"its session record lacks {name}")
    return session


def _names(session: dict[str, str]) -> tuple[str, str]:
    """Names of the attachments that are configuration and model."""
    return session.get("config_name", ""), session.get("model_name", "")


def _use_its_version(session: dict[str, str]) -> str:
    return f"use hapticd {session.get('hapticd', 'of that time')}"


def _text(path: str, attachment: Attachment) -> str:
    try:
        return attachment.data.decode()
    except UnicodeDecodeError as error:
        raise _damaged(path, f"its attachment {attachment.name} is not UTF-8 text") from error


def _damaged(path: str, what: str) -> LogError:
    return LogError(path, f"is damaged: {what}", "use another copy of the recording")


def _dtype(path: str, schema: bytes, fix: str) -> np.dtype[np.void]:
    """The structure of the records, which begins with what is recorded of every machine's tick.

    Raises:
        LogModelError: it begins with something else; ``fix`` says what reads that.
        LogError: it is none.
    """
    head = [name for name, _, _ in HEAD]
    try:
        dtype: np.dtype[np.void] = np.dtype(_tuples(json.loads(schema)))
        known = list(dtype.names or ())[: len(head)] == head and all(
            dtype[name] == np.dtype(kind) for name, kind, _ in HEAD
        )
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise _damaged(path, f"its schema cannot be read: {error}") from error
    if dtype.names and not known:
        raise LogModelError(path, "keeps other fields of a tick", fix)
    if not known or dtype.hasobject or dtype.itemsize > MAX_RECORD:
        raise _damaged(path, "its schema describes no records of this program")
    return dtype


def _tuples(descr: Any) -> Any:
    """JSON turned numpy's tuples into lists."""
    fields = []
    for name, kind, *shape in descr:
        fields.append((name, _tuples(kind) if isinstance(kind, list) else kind, *(tuple(s) for s in shape)))
    return fields


def _messages(path: str, topic: str, allowed: Sequence[bytes]) -> Iterator[bytes]:
    """Messages of the one channel of a topic, which has one of these schemas and keeps it."""
    schemas: dict[int, bytes] = {}
    channels: dict[int, Channel] = {}
    wanted: int | None = None
    for item in read(path):
        match item:
            case Message():
                if item.channel_id == wanted:
                    yield item.data
                elif item.channel_id not in channels:
                    raise _damaged(path, f"a message of channel {item.channel_id}, which there is not")
            case Channel():
                if channels.setdefault(item.id, item) != item:
                    raise _damaged(path, f"channel {item.id} changes")
                if item.topic != topic:
                    continue
                if wanted not in (None, item.id) or schemas.get(item.schema_id) not in allowed:
                    raise _damaged(path, f"channel '{topic}' comes twice, or with another schema")
                wanted = item.id
            case Schema():
                if schemas.setdefault(item.id, item.data) != item.data:
                    raise _damaged(path, f"schema {item.id} changes")
