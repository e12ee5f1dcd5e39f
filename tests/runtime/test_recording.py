"""Recordings of unknown origin: typed errors that say what and where, within bounds of memory and time."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import zstandard
from hapticd.runtime.errors import LogError, LogModelError, LogTruncatedError
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.reader import ALLOWANCE, MAX_COUNT, MAX_RATIO
from hapticd.runtime.recording.record import head

from .conftest import loaded
from .hostile_logs import (
    CHANNEL,
    CHUNK,
    DATA_END,
    MAGIC,
    MESSAGE,
    SCHEMA,
    Parts,
    attachment,
    chunk,
    frame,
    metadata,
    put_together,
    take_apart,
    text,
)

FORGERIES = 360


def test_forged_recordings_are_refused_within_a_second_and_64_mib(tmp_path: Path) -> None:
    forge = [sys.executable, str(Path(__file__).with_name("hostile_logs.py"))]
    out = subprocess.run(
        [*forge, "11", str(FORGERIES), str(tmp_path)], capture_output=True, text=True, timeout=300, check=True
    )
    found = json.loads(out.stdout)
    assert found["wrong"] == []
    assert FORGERIES // 3 < found["refused"] < FORGERIES


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("log") / "good.mcap"
    lockstep_run.run(loaded(machine="rhi"), path, 0.2, False)
    return path.read_bytes()


@pytest.fixture
def reading(tmp_path: Path) -> Callable[[bytes], int]:
    """How many ticks there are in a file with some content."""

    def read(data: bytes) -> int:
        path = tmp_path / "x.mcap"
        path.write_bytes(data)
        log = open_log(str(path))
        list(log.events())
        return sum(1 for _ in log.records())

    return read


def first(parts: Parts, opcode: int) -> int:
    return next(k for k, part in enumerate(parts) if part[0] == opcode)


def test_what_is_put_together_again_is_read_as_before(good: bytes, reading: Callable[[bytes], int]) -> None:
    assert reading(put_together(take_apart(good))) == reading(good) > 200


def test_zeros_that_expand_beyond_a_limit_are_refused(good: bytes, reading: Callable[[bytes], int]) -> None:
    zeros = zstandard.compress(bytes(40 << 20))
    assert len(zeros) < 10_000
    no_words = frame(MESSAGE, (3).to_bytes(2, "little") + bytes(20))
    parts = take_apart(good)
    for extra, what in (
        (chunk(b"", 40 << 20, packed=zeros), "a chunk of 41943040 bytes; at most 4194304 are read"),
        (chunk(b"", 100, packed=zeros), "another length than the 100 bytes that it names"),
        (chunk(no_words * 100_000) * 20, "expands to more than 200 times its length"),
        (chunk(b"x", kind=b"lz4"), "compressed with 'lz4'; hapticd reads and writes zstd"),
    ):
        with pytest.raises(LogError, match=what) as error:
            reading(put_together(parts, extra))
        assert " at byte " in str(error.value)


def test_records_count_even_where_they_are_empty(good: bytes, reading: Callable[[bytes], int]) -> None:
    """Their bytes alone are half of what a file may expand to."""
    empty, parts = frame(MESSAGE, (3).to_bytes(2, "little") + bytes(20)), take_apart(good)
    allowed = ALLOWANCE + MAX_RATIO * len(good)
    crowd = chunk(empty * 20_000) * (allowed // (2 * len(empty) * 20_000))
    with pytest.raises(LogError, match="or to too many records"):
        reading(put_together(parts, crowd))


def test_an_absurd_length_is_refused_where_it_stands(good: bytes, reading: Callable[[bytes], int]) -> None:
    whole = put_together(take_apart(good))
    end = whole.rindex(frame(DATA_END, b"", 4))
    forged = whole[:end] + frame(7, b"", 1 << 62) + whole[end:]
    with pytest.raises(LogError, match=f"at byte {end}: a record of {1 << 62} bytes"):
        reading(forged)


def test_a_file_that_lacks_its_end_is_cut_off_even_if_its_last_bytes_fit(
    good: bytes, reading: Callable[[bytes], int]
) -> None:
    for size in (len(good) // 2, len(good) - 9):
        with pytest.raises(LogTruncatedError, match="ends in the middle"):
            reading(good[:size])
    with pytest.raises(LogTruncatedError, match="ends in the middle"):
        reading(good[: good.rindex(frame(DATA_END, b"", 4))] + MAGIC)


def test_a_chunk_that_passes_for_something_else_is_missed(
    good: bytes, reading: Callable[[bytes], int]
) -> None:
    """No index and no count is needed for that: the file ends with the checksum of its data."""
    places = []
    at = len(MAGIC)
    while at < len(good) - len(MAGIC):
        if good[at] == CHUNK:
            places.append(at)
        at += 9 + int.from_bytes(good[at + 1 : at + 9], "little")
    assert len(places) > 2
    forged = bytearray(good)
    forged[places[1]] = 0x80  # a private record, which a reader skips
    with pytest.raises(LogError, match="checksum"):
        reading(bytes(forged))


def test_attachments_and_metadata_without_end_are_refused(
    good: bytes, reading: Callable[[bytes], int]
) -> None:
    parts = take_apart(good)
    for make in (lambda k: attachment(str(k), b"x"), lambda k: metadata(str(k), {"a": "b"})):
        some, many = ([make(k) for k in range(count)] for count in (3, MAX_COUNT + 1))
        assert reading(put_together([parts[0], *some, *parts[1:]])) > 200
        with pytest.raises(LogError, match=f"more than {MAX_COUNT} records of kind"):
            reading(put_together([parts[0], *many, *parts[1:]]))


def test_a_second_channel_schema_or_session_is_refused(good: bytes, reading: Callable[[bytes], int]) -> None:
    parts = take_apart(good)
    at = first(parts, CHANNEL)
    tick = parts[at][1]
    for forged, what in (
        ((CHANNEL, b"\x09\x00" + tick[2:]), "channel 'tick' comes twice"),
        ((CHANNEL, tick[:2] + b"\x02\x00" + tick[4:]), "channel 1 changes"),
        ((SCHEMA, b"\x01\x00" + text(b"other") + text(b"") + text(b"{}")), "schema 1 changes"),
        ((CHANNEL, b"\x09\x00\x01\x00" + text(b"ticks") + text(b"") + text(b"")), None),
    ):
        whole = put_together([*parts[: at + 1], forged, *parts[at + 1 :]])
        if what is None:
            assert reading(whole) > 200  # a channel that is none of ours
            continue
        with pytest.raises(LogError, match=what):
            reading(whole)
    k = next(k for k, part in enumerate(parts) if part[1][4:].startswith(b"session"))
    with pytest.raises(LogError, match="describes two sessions"):
        reading(put_together([*parts[:k], parts[k], *parts[k:]]))
    with pytest.raises(LogError, match="not a recording of hapticd"):
        reading(put_together([*parts[:k], *parts[k + 1 :]]))


def test_a_configuration_that_is_refused_names_the_recording(
    good: bytes, reading: Callable[[bytes], int]
) -> None:
    parts = take_apart(good)
    k = first(parts, attachment("", b"")[0])
    name = parts[k][1][20:][: int.from_bytes(parts[k][1][16:20], "little")].decode()
    for content, error, what in (
        (b"system = 1", LogModelError, "configuration that is refused here"),
        (b"\xff", LogError, "is not UTF-8 text"),
        (b"#" * (1 << 20), LogError, "at most 1048576 are read"),
    ):
        with pytest.raises(error, match=what):
            reading(put_together([*parts[:k], attachment(name, content), *parts[k + 1 :]]))


def test_a_recording_with_other_fields_is_of_another_program_and_not_damaged(
    good: bytes, reading: Callable[[bytes], int]
) -> None:
    parts = take_apart(good)
    k = next(k for k, (kind, content) in enumerate(parts) if kind == SCHEMA and b'["tick"' in content)
    kind, schema = parts[k]
    with pytest.raises(LogModelError, match=r"keeps other fields of a tick; use hapticd \d"):
        reading(put_together([*parts[:k], (kind, schema.replace(b'["tick"', b'["kcit"')), *parts[k + 1 :]]))


def test_what_a_recording_says_of_itself_cannot_write_to_the_terminal(
    good: bytes, reading: Callable[[bytes], int]
) -> None:
    parts = take_apart(good)
    k = next(k for k, part in enumerate(parts) if part[1][4:].startswith(b"session"))
    with pytest.raises(LogError, match="what is not a line of text"):
        reading(put_together([*parts[:k], metadata("session", {"layout": "\x1b]0;x\x07"}), *parts[k + 1 :]]))


def test_two_recordings_in_one_file_are_not_taken_for_one(
    good: bytes, reading: Callable[[bytes], int]
) -> None:
    with pytest.raises(LogError, match="something stands behind its end"):
        reading(good + good)


def test_the_head_of_a_record_is_what_numpy_reads(good: bytes, tmp_path: Path) -> None:
    path = tmp_path / "good.mcap"
    path.write_bytes(good)
    for record in open_log(str(path)).records():
        said = head(record.fixed)
        assert said["stage_ns"] == record.fixed["stage_ns"].tobytes()
        read = {name: record.fixed[name] for name in said if name != "stage_ns"}
        assert {name: said[name] for name in read if name != "reason"} == {
            name: value for name, value in read.items() if name != "reason"
        }
        assert said["reason"].rstrip(b"\0") == read["reason"]
