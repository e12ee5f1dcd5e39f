"""Both stations in lockstep with a process each: the session of one process, whatever becomes of either."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from errno import ENOSPC
from pathlib import Path

import pytest
from hapticd.machines.telemanipulation import apart, pair_run
from hapticd.machines.telemanipulation.pair import Pair, declared
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.config import Loaded
from hapticd.runtime.live.outcome import Outcome
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.log_file import LogFile
from hapticd.runtime.recording.replay import replay
from hapticd.sim.network_model import Conditions, NetworkModel

STATIONS = ("operator", "avatar")
HAPTICD = (sys.executable, "-m", "hapticd.runtime", "bimanual")


def stations(conditions: Conditions) -> list[Loaded]:
    loaded = [config.load(name) for name in STATIONS]
    return [declared(each, conditions.longest) for each in loaded] if conditions.longest else loaded


def session(
    run, folder: Path, conditions: Conditions, seconds: float = 0.8
) -> tuple[list[Path], list[Outcome]]:
    folder.mkdir()
    logs = [folder / f"{name}.mcap" for name in STATIONS]
    both = stations(conditions)
    outcomes, _ = run(Pair(*both, NetworkModel(conditions, 7)), both, logs, seconds, False)
    return logs, outcomes


def records(log: Path) -> list[bytes]:
    return [record.data for record in open_log(str(log)).records()]


@pytest.mark.parametrize("conditions", [Conditions(), Conditions(0.004, 0.003, 0.05)], ids=["ideal", "poor"])
def test_it_is_the_session_of_one_process_tick_by_tick(tmp_path: Path, conditions: Conditions) -> None:
    one, outcomes = session(pair_run.pair_run, tmp_path / "one", conditions)
    two, again = session(apart.run_apart, tmp_path / "two", conditions)
    assert [each.status for each in (*outcomes, *again)] == [0] * 4
    for here, there in zip(one, two, strict=True):
        expected, found = records(here), records(there)
        assert len(expected) > 800
        assert found[: len(expected)] == expected
        assert len(found) <= len(expected) + 2, "each learns a tick later that the other one rests"
        assert replay(open_log(str(there))).differing_ticks == 0


def begun(folder: Path, *more: str) -> tuple[subprocess.Popen[str], list[Path]]:
    """A long session as a person begins one, once both of its logs grow."""
    logs = [folder / f"long-{name}.mcap" for name in STATIONS]
    child = subprocess.Popen(
        [*HAPTICD, "--duration", "1000", "--logs", str(folder / "long"), "--json", *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while child.poll() is None and not all(log.exists() and log.stat().st_size > 200_000 for log in logs):
        time.sleep(0.05)
    return child, logs


def the_other(child: subprocess.Popen[str]) -> int:
    """The process of the avatar."""
    return int(Path(f"/proc/{child.pid}/task/{child.pid}/children").read_text().split()[0])


def whole(log: Path) -> bool:
    """Whether a log is complete, and replays."""
    return replay(open_log(str(log))).differing_ticks == 0


@pytest.mark.parametrize("group", [True, False], ids=["ctrl-c", "kill"])
def test_a_signal_to_all_or_to_the_program_alone_ends_both(tmp_path: Path, group: bool) -> None:
    child, logs = begun(tmp_path)
    (os.killpg if group else os.kill)(child.pid, signal.SIGINT)
    said, complaint = child.communicate(timeout=60)
    assert child.returncode == 0 and not complaint, complaint
    for name, log in zip(STATIONS, logs, strict=True):
        assert "interrupted" in json.loads(said)[name]["message"]
        assert whole(log)


def test_a_second_signal_ends_the_program_though_the_avatar_is_suspended(tmp_path: Path) -> None:
    child, _ = begun(tmp_path)
    other = the_other(child)
    os.kill(other, signal.SIGSTOP)
    for _ in range(2):
        time.sleep(0.3)
        os.kill(child.pid, signal.SIGINT)
    child.communicate(timeout=30)
    assert child.returncode != 0
    assert not Path(f"/proc/{other}").exists()


def test_an_avatar_whose_process_is_killed_ends_the_operator_s_session(tmp_path: Path) -> None:
    child, logs = begun(tmp_path)
    os.kill(the_other(child), signal.SIGKILL)
    said, _ = child.communicate(timeout=60)
    assert child.returncode == 1
    assert json.loads(said)["avatar"]["message"] == apart.LOST
    assert json.loads(said)["operator"]["status"] == 0
    assert whole(logs[0])


def test_an_avatar_whose_program_is_killed_brings_itself_to_an_end(tmp_path: Path) -> None:
    child, logs = begun(tmp_path)
    other = the_other(child)
    child.kill()
    child.communicate()
    while Path(f"/proc/{other}/stat").exists() and "Z" not in Path(f"/proc/{other}/stat").read_text().split():
        time.sleep(0.02)
    assert whole(logs[1])


@pytest.mark.parametrize("short", STATIONS)
def test_where_one_disk_is_full_both_come_to_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, short: str
) -> None:
    write = LogFile.write

    def until_full(self: LogFile, data: bytes) -> int:
        if Path(str(self.name)).stem == short and self.tell() > 300_000 and not self.full:
            self._give_up(OSError(ENOSPC, os.strerror(ENOSPC)))
        return write(self, data)

    monkeypatch.setattr(LogFile, "write", until_full)
    logs, outcomes = session(apart.run_apart, tmp_path / "disk", Conditions(), 100.0)
    for name, log, outcome in zip(STATIONS, logs, outcomes, strict=True):
        assert ("the disk took no more" in outcome.message) == (name == short), outcome.message
        assert outcome.status == int(name == short)
        assert outcome.report.ticks < 3000
        assert whole(log)
