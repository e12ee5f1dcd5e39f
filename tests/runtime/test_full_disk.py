"""A disk that takes no more: no traceback, a log that holds what it took, and a person who is told."""

from __future__ import annotations

import errno
import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from hapticd.runtime.recording import log_file
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.log_file import RESERVE_BYTES, LogFile, LogWriteError
from hapticd.runtime.recording.replay import replay

HAPTICD = (sys.executable, "-m", "hapticd.runtime")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system with room for the reserve and some seconds of a recording."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if os.geteuid():
        pytest.skip("only root mounts a file system")
    mount = ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(folder)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("this host mounts no tmpfs")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


def run(
    *arguments: str, limit: int | None = None, output: int = subprocess.PIPE
) -> subprocess.CompletedProcess[str]:
    """A session, with a limit to the size of its files where one is given."""

    def limited() -> None:
        if limit:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    return subprocess.run(
        [*HAPTICD, "run", *arguments],
        stdout=output,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=limited,
        check=False,
        timeout=120.0,
    )


def check(done: subprocess.CompletedProcess[str], log: Path) -> None:
    """It says what happened, and the log holds what it says."""
    report = msgspec.json.decode(done.stdout)
    assert done.returncode == (3 if report["stop"] else 1)  # a busy host may stop it, too
    assert "Traceback" not in done.stderr
    assert f"the disk took no more (No space left on device): the log {log} holds the first" in done.stderr
    found = replay(open_log(str(log)))
    assert found.ticks == report["ticks"] > 500
    assert found.differing_ticks == 0


def test_on_a_full_disk_a_lockstep_session_ends_with_a_log_that_replays(
    small_disk: Path, machine: str
) -> None:
    log = small_disk / "a.mcap"
    done = run(machine, "--lockstep", "--json", "--log", str(log))
    check(done, log)
    assert done.returncode == 1


def test_on_a_full_disk_a_live_session_goes_on_unrecorded_and_its_log_replays(
    small_disk: Path, machine: str
) -> None:
    log = small_disk / "a.mcap"
    done = run(machine, "--duration", "8", "--json", "--log", str(log))
    check(done, log)
    # by then the recorder has ended, or is still completing its log
    assert "what runs goes on, and the machine is not armed again" in done.stderr
    assert msgspec.json.decode(done.stdout)["ticks"] < 8000


def test_a_log_that_cannot_be_completed_is_called_so(tmp_path: Path, machine: str) -> None:
    done = run(machine, "--lockstep", "--json", "--log", str(tmp_path / "a.mcap"), limit=RESERVE_BYTES)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert "(File too large)" in done.stderr
    assert "ends in the middle and cannot be replayed" in done.stderr


@pytest.mark.parametrize("how", [(), ("--lockstep",)])
def test_where_there_is_no_room_for_a_log_nothing_starts(
    small_disk: Path, machine: str, how: tuple[str, ...]
) -> None:
    (small_disk / "other").write_bytes(bytes(1536 << 10))
    log = small_disk / "a.mcap"
    done = run(machine, *how, "--log", str(log))
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert f"cannot write the log {log}: No space left on device" in done.stderr
    assert "READY" not in done.stderr
    assert not log.exists()


@pytest.mark.parametrize("path", ["/dev/null/a.mcap", "/proc/a.mcap", "/dev/null"])
def test_a_place_that_takes_no_log_is_named_before_anything_starts(path: str) -> None:
    done = run("giant", "--log", path)
    assert done.returncode == 2
    assert "error [log-path]" in done.stderr and path in done.stderr
    assert "Traceback" not in done.stderr and "READY" not in done.stderr


@pytest.mark.parametrize("how", [("--lockstep",), ("--duration", "0.5")])
def test_a_summary_that_nobody_takes_is_an_error_without_a_traceback(
    tmp_path: Path, how: tuple[str, ...]
) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full")
    with open("/dev/full", "w") as full:
        options = (*how, "--log", str(tmp_path / "a.mcap"))
        done = run("giant", *options, "--duration", "0.5", output=full.fileno())
    assert done.returncode == 1
    assert "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr
    assert open_log(str(tmp_path / "a.mcap")).events()


def test_a_reserve_that_cannot_be_had_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", refuse)
    with pytest.raises(LogWriteError, match="No space left on device"):
        LogFile(tmp_path / "a")


def test_the_reserve_grows_with_the_log_and_is_on_no_list(tmp_path: Path) -> None:
    with LogFile(tmp_path / "a") as stream:
        for _ in range(130):
            stream.write(bytes(1 << 20))
        held = os.fstat(stream._reserve.fileno()).st_size
        assert held >= log_file.INDEX_SHARE * stream.tell()
        assert [path.name for path in tmp_path.iterdir()] == ["a"]
