"""Frames in shared memory: what a reader gets, what it misses, and that the writer never notices."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from hapticd.runtime.recording import published
from hapticd.runtime.recording.frames import Frame
from hapticd.runtime.recording.published import (
    SLOT_BYTES,
    SLOTS,
    About,
    Publisher,
    SessionError,
    Subscriber,
    run_folder,
    running,
    sweep,
)

ABOUT = About("a.mcap", "giant", "t" * 20_000, "giant.toml", "<m/>", "giant.urdf", 1000.0, 7, ["stop"])


def frame(tick: int) -> Frame:
    return Frame(tick=tick, ticks=20, published_ns=0, mode="ACTIVE", mean=[float(tick)])


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return run_folder() / "7.frames"


def test_a_reader_gets_every_frame_once_and_counts_those_that_were_overwritten(path: Path) -> None:
    writer = Publisher(path, ABOUT)
    for tick in range(5):
        writer.publish(frame(tick))
    reader = Subscriber(path)
    assert reader.about == ABOUT
    assert [each.tick for each in reader.take()] == [4]  # from the newest on
    assert reader.take() == []
    for tick in range(5, 5 + 2 * SLOTS):
        writer.publish(frame(tick))
    ticks = [each.tick for each in reader.take()]
    assert ticks == list(range(5 + 2 * SLOTS - len(ticks), 5 + 2 * SLOTS))
    assert len(ticks) + reader.missed == 2 * SLOTS
    assert SLOTS - 1 <= len(ticks) <= SLOTS


def test_a_slot_that_changes_while_it_is_read_is_no_frame(path: Path) -> None:
    writer = Publisher(path, ABOUT)
    writer.publish(frame(0))
    reader = Subscriber(path)
    writer.publish(frame(1))
    writer.publish(frame(2))
    at = writer._slots + 1 * SLOT_BYTES + 30
    writer._map[at] ^= 0xFF
    assert [each.tick for each in reader.take()] == [0, 2]
    assert reader.missed == 1


def test_a_frame_that_is_too_long_is_left_out_and_counted(path: Path) -> None:
    writer = Publisher(path, ABOUT)
    long = frame(1)
    long.mean = [0.1] * SLOT_BYTES
    writer.publish(long)
    assert (writer.count, writer.unfit) == (0, 1)


def test_a_session_is_found_while_it_runs_and_over_when_its_writer_is_gone(path: Path) -> None:
    assert running() == []
    writer = Publisher(path, ABOUT)
    assert running() == [path]
    reader = Subscriber(path)
    assert not reader.over
    writer._map.close()
    os.close(writer._fd)  # as the kernel does for a process that was killed
    assert reader.over
    assert path.exists() and running() == []
    Publisher(path, ABOUT)  # a later process of the same number takes its place


@pytest.mark.parametrize("content", [b"", b"hapticd1", b"x" * 3_000_000])
def test_what_is_no_session_is_refused(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    with pytest.raises(SessionError, match="no session of this version"):
        Subscriber(path)
    assert running() == []


def test_a_folder_that_others_can_enter_is_not_used(path: Path) -> None:
    path.parent.chmod(0o755)
    with pytest.raises(SessionError, match="not a folder that is yours alone"):
        run_folder()
    path.parent.chmod(0o700)
    assert run_folder() == path.parent


def test_without_a_runtime_folder_of_the_user_there_is_one_among_the_temporary_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr(published.tempfile, "gettempdir", lambda: str(tmp_path))
    assert run_folder() == tmp_path / f"hapticd-{os.getuid()}"
    assert run_folder().stat().st_mode & 0o777 == 0o700


def test_what_a_killed_session_left_is_swept_and_what_runs_is_not(path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        pass
    dead, folder = str(process.pid), run_folder()
    for name in (f"{dead}.frames", f"{dead}.orders", f"{os.getpid()}.frames", "notes.frames"):
        (folder / name).touch()
    sweep()
    kept = [f"{os.getpid()}.frames", "notes.frames"]
    assert sorted(each.name for each in folder.iterdir()) == sorted(kept)
    written = Publisher(folder / f"{dead}.frames", ABOUT)  # as of a process that has a number of its own here
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as heard:
        heard.bind(os.fspath(folder / f"{dead}.orders"))
        sweep()
        assert len(list(folder.iterdir())) == 4
    sweep()  # nobody hears it any more
    assert not (folder / f"{dead}.orders").exists() and running() == [folder / f"{dead}.frames"]
    written.close()
