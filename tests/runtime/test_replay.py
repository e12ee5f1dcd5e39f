"""Recording and replay: bit for bit, and honest about every difference."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hapticd.machines.rendering import rendering
from hapticd.models import Array
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.events import Severity
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.errors import LogError, LogModelError, LogTruncatedError
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.recording.log import TEXT_SCHEMA, open_log
from hapticd.runtime.recording.record import INPUTS, TIMING, Record, differences, parse
from hapticd.runtime.recording.replay import replay
from mcap.reader import make_reader
from mcap.writer import Writer

from .conftest import loaded

DURATION = 4.5
"""Long enough for bring-up, engaging and some ticks of the rendered twin."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "session.mcap"
    outcome = lockstep_run.run(loaded(), path, DURATION, False)
    assert outcome.status == 0
    return path


def rewrite(
    source: Path,
    target: Path,
    change: Callable[[int, bytes], bytes] = lambda _, data: data,
    metadata: dict[str, str] | None = None,
    words_only: bool = False,
) -> None:
    """Copy a recording, passing every tick's bytes through ``change``.

    ``words_only`` keeps no more of an event than its tick and what people read.
    """
    with source.open("rb") as inp, target.open("wb") as out:
        reader, writer = make_reader(inp), Writer(out)
        writer.start("hapticd")
        for item in reader.iter_metadata():
            data = item.metadata | (metadata or {}) if item.name == "session" else item.metadata
            writer.add_metadata(item.name, data)
        for a in reader.iter_attachments():
            writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
        channels: dict[int, int] = {}
        index = 0
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert schema is not None
            if channel.id not in channels:
                text = TEXT_SCHEMA.encode() if words_only and channel.topic == "event" else schema.data
                known = writer.register_schema(schema.name, schema.encoding, text)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, known)
            data = message.data
            if channel.topic == "tick":
                data, index = change(index, data), index + 1
                if not data:
                    continue  # a recorder lost it
            elif words_only and channel.topic == "event":
                event = msgspec.json.decode(data)
                data = msgspec.json.encode({"tick": event["tick"], "text": event["text"]})
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time)
        writer.finish()


def test_a_replayed_session_is_the_same_in_every_bit(recording: Path) -> None:
    found = replay(open_log(str(recording)))
    assert found.ticks >= DURATION * 1000
    assert found.differing_ticks == 0
    assert found.first == []
    assert found.environment == {}


def test_two_sessions_with_one_seed_are_the_same_and_another_seed_is_not(
    recording: Path, tmp_path: Path
) -> None:
    again, other = tmp_path / "again.mcap", tmp_path / "other.mcap"
    lockstep_run.run(loaded(), again, DURATION, False)
    lockstep_run.run(loaded(("seed = 1", "seed = 2")), other, DURATION, False)
    assert again.read_bytes() == recording.read_bytes()  # whatever the file is called
    first, third = (list(open_log(str(path)).records()) for path in (recording, other))
    assert [r.data for r in first] != [r.data for r in third]


@pytest.mark.parametrize("place", ["first byte", "identifier", "length", "data of joint_1", "last byte"])
@pytest.mark.parametrize("tick", [0, 250, 4200])
def test_one_changed_byte_of_a_recorded_frame_is_found_and_named(
    recording: Path, tmp_path: Path, place: str, tick: int
) -> None:
    log = open_log(str(recording))
    changed: list[int] = []

    def flip(index: int, data: bytes) -> bytes:
        record = parse(data, log.dtype)
        assert record is not None
        if changed or index < tick or not record.frames_in:
            return data
        changed.append(int(record.fixed["tick"]))
        start = log.dtype.itemsize
        at = (
            start
            + {
                "first byte": 0,
                "identifier": 1,
                "length": 4,
                "data of joint_1": 6 + min(9, record.frames_in[4] - 1),
                "last byte": len(record.frames_in) - 1,
            }[place]
        )
        return data[:at] + bytes([data[at] ^ 0x01]) + data[at + 1 :]

    copy = tmp_path / "changed.mcap"
    rewrite(recording, copy, flip)
    found = replay(open_log(str(copy)))
    assert found.differing_ticks >= 1
    assert found.first[0].tick == changed[0]
    assert found.first[0].field
    if place == "data of joint_1" and tick == 4200:
        assert found.first[0].field.startswith("joint_1.")


@pytest.fixture(scope="module")
def active(recording: Path) -> Record:
    """A tick of the rendered twin."""
    return next(islice(open_log(str(recording)).records(), 4200, None))


def flipped(data: bytes, at: int) -> bytes:
    return data[:at] + bytes([data[at] ^ 0x01]) + data[at + 1 :]


def test_every_byte_of_a_record_but_its_durations_decides_whether_it_is_the_same(active: Record) -> None:
    fields = active.fixed.dtype.fields
    assert fields is not None
    places = [range(fields[name][1], fields[name][1] + fields[name][0].itemsize) for name in TIMING]
    durations = {at for place in places for at in place}
    assert len(durations) < 100 < len(active.data)
    for at in range(len(active.data)):
        assert active.same_as(flipped(active.data, at)) == (at in durations)
    assert not active.same_as(active.data[:-1])


def test_every_field_that_differs_is_named(active: Record) -> None:
    dtype, network = active.fixed.dtype, build(loaded()).network
    assert dtype.fields is not None
    computed = [name for name in dtype.names or () if name not in (*TIMING, *INPUTS, "raw", "state")]
    places = {name: dtype.fields[name] for name in computed}
    state, start = dtype.fields["state"][:2]
    places |= {f"state.{name}": (kind, start + at) for name, (kind, at, *_) in (state.fields or {}).items()}
    for name, (kind, at, *_) in places.items():
        other = parse(flipped(active.data, at + kind.itemsize - 1), dtype)
        if name == "out_bytes":
            assert other is None  # its frames would end elsewhere
            continue
        assert other is not None
        ((field, before, after),) = differences(active, other, network)
        assert field.replace("frames received (digest)", "digest").startswith(name)
        assert before != after
    other = parse(flipped(active.data, len(active.data) - 1), dtype)
    assert other is not None
    assert [field for field, _, _ in differences(active, other, network)] == ["frames sent"]


def test_a_recording_whose_outputs_are_others_than_the_cycle_s_is_found_out(
    recording: Path, tmp_path: Path
) -> None:
    log = open_log(str(recording))
    fields = log.dtype.fields
    assert fields is not None
    state, start = fields["state"][:2]
    assert state.fields is not None
    places = {
        1000: fields["mode"][1],
        2000: fields["admitted"][1],
        3000: start + state.fields["qdd"][1],
        4000: log.dtype.itemsize - 1,  # the process image ends with what was sent
        4400: -1,  # the last frame sent
    }
    copy = tmp_path / "changed.mcap"
    rewrite(recording, copy, lambda i, data: flipped(data, places[i] % len(data)) if i in places else data)
    found = replay(open_log(str(copy)))
    assert found.differing_ticks == len(places)
    assert {(d.tick, d.field) for d in found.first} == {(1000, "mode")}


def test_ticks_that_the_recorder_lost_are_counted(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "lost.mcap"
    rewrite(recording, copy, lambda i, data: b"" if 2000 <= i < 2007 or i == 3000 else data)
    assert replay(open_log(str(copy))).missing_ticks == 8
    assert replay(open_log(str(recording))).missing_ticks == 0
    assert main(["replay", str(copy), "--verify"]) == 1
    assert "8 ticks not in the recording" in capsys.readouterr().out


def test_a_program_that_computes_something_else_is_found_out(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    modes = [int(record.fixed["mode"]) for record in open_log(str(recording)).records()]
    stopping = modes.index(Mode.STOPPING)
    doubt = rendering.Rendering._doubt

    def other(self: rendering.Rendering, wrench: Array | None) -> None:
        doubt(self, wrench)
        self.wrench *= 1.0 + 1e-9

    monkeypatch.setattr(rendering.Rendering, "_doubt", other)
    found = replay(open_log(str(recording)))
    assert found.first[0].tick == stopping
    assert any(d.field.startswith("state.wrench") for d in found.first)
    assert 1 <= found.differing_ticks <= len(modes) - stopping


def test_the_command_line_verifies_with_its_exit_status_and_json(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(recording), "--verify"]) == 0
    assert "ticks, 0 differ" in capsys.readouterr().out
    assert main(["replay", str(recording), "--verify", "--json"]) == 0
    result = msgspec.json.decode(capsys.readouterr().out)
    assert {"ticks", "differing_ticks", "first", "speed_x"} <= set(result)
    assert result["differing_ticks"] == 0

    log = open_log(str(recording))
    copy = tmp_path / "changed.mcap"

    def flip(index: int, data: bytes) -> bytes:
        at = log.dtype.itemsize + 12
        return data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1 :] if index == 4000 else data

    rewrite(recording, copy, flip)
    assert main(["replay", str(copy), "--verify", "--json"]) == 1
    result = msgspec.json.decode(capsys.readouterr().out)
    assert result["first"][0]["tick"] == 4000
    assert main(["replay", str(copy), "--verify"]) == 1
    assert "first at tick 4000: joint_1." in capsys.readouterr().out
    assert main(["replay", str(copy)]) == 0  # without --verify it only reports


def test_a_truncated_recording_is_a_typed_error(recording: Path, tmp_path: Path) -> None:
    data = recording.read_bytes()
    for size in (9, len(data) // 3, len(data) - 1):
        cut = tmp_path / f"{size}.mcap"
        cut.write_bytes(data[:size])
        with pytest.raises(LogTruncatedError, match="ends in the middle"):
            replay(open_log(str(cut)))


def test_ticks_that_do_not_match_their_checksum_are_damaged(recording: Path, tmp_path: Path) -> None:
    data = bytearray(recording.read_bytes())
    with recording.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[len(summary.chunk_indexes) // 2]
    # opcode, length, first and last time and size stand in front of the checksum (MCAP, "Chunk")
    data[chunk.chunk_start_offset + 1 + 4 * 8] ^= 0x01
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    with pytest.raises(LogError, match="is damaged") as caught:
        replay(open_log(str(path)))
    assert caught.value.exit_status == 2


def test_damage_anywhere_is_a_typed_error_or_a_difference(recording: Path, tmp_path: Path) -> None:
    data = bytearray(recording.read_bytes())
    rng = np.random.default_rng(5)
    for at in rng.integers(8, len(data) - 8, 12):
        damaged = bytearray(data)
        damaged[at] ^= 0xFF
        path = tmp_path / "damaged.mcap"
        path.write_bytes(damaged)
        try:
            for _ in open_log(str(path)).records():
                pass
        except LogError as error:
            assert error.exit_status == 2


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89MCAP0\r\n", b"\x00" * 100_000])
def test_something_else_is_no_recording(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError):
        open_log(str(path))
    with pytest.raises(LogError, match="cannot be read"):
        open_log(str(tmp_path / "none.mcap"))


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ({"sha256_model": "0"}, "another model"),
        ({"sha256_config": "0"}, "another configuration"),
        ({"sha256_layout": "0"}, "another process image"),
        ({"layout": "99"}, "record layout 99"),
    ],
)
def test_a_recording_of_another_machine_is_a_typed_error(
    recording: Path, tmp_path: Path, metadata: dict[str, str], message: str
) -> None:
    copy = tmp_path / "other.mcap"
    rewrite(recording, copy, metadata=metadata)
    with pytest.raises(LogModelError, match=message):
        replay(open_log(str(copy)))


def test_a_recording_from_another_computer_says_so(recording: Path, tmp_path: Path) -> None:
    copy = tmp_path / "elsewhere.mcap"
    rewrite(recording, copy, metadata={"cpu": "Z80"})
    found = replay(open_log(str(copy)))
    assert found.environment["cpu"][0] == "Z80"


def test_the_events_of_a_session_are_in_its_log(recording: Path) -> None:
    events = [event.text for event in open_log(str(recording)).events()]
    assert [event.split(":")[0] for event in events] == [
        "READY", "ENABLING", "ENGAGING", "ACTIVE", "STOPPING", "STOPPED",
    ]  # fmt: skip


def test_the_log_keeps_code_severity_and_values_of_an_event_and_what_people_read(recording: Path) -> None:
    *_, ending, off = open_log(str(recording)).events()
    assert (ending.code, ending.severity, ending.values["reason"]) == ("ending", Severity.NOTE, "end")
    assert ending.text == f"STOPPING: R3 end at tick {ending.tick}: the session ends"
    assert (off.code, off.values) == ("switched_off", {})


def test_a_recording_that_keeps_no_more_of_its_events_than_their_words_is_read(
    recording: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "words.mcap"
    rewrite(recording, copy, words_only=True)
    kept, known = (list(open_log(str(path)).events()) for path in (copy, recording))
    assert [(event.tick, event.text) for event in kept] == [(event.tick, event.text) for event in known]
    assert {(event.code, event.severity) for event in kept} == {("", None)}
