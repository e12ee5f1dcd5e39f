"""No child outlives its parent, however that dies; what a child had to bring to an end, it does."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hapticd.testing.terminal import CTRL_C, ENVIRONMENT, Terminal, complete, family

PARENTS = {
    "run giant": ("run", "giant"),
    "run rhi": ("run", "rhi"),
    "bench tick": ("bench", "tick", "--rounds", "2", "--seconds", "2"),
    "bench jitter": ("bench", "jitter", "--rounds", "2", "--seconds", "2"),
}

Open = Callable[..., Terminal]


@pytest.mark.parametrize("moment", [0.25, 0.7, 1.1, 1.6, 2.4, 4.5])
@pytest.mark.parametrize("name", PARENTS)
def test_nobody_outlives_a_killed_parent(
    open_hapticd: Open, tmp_path: Path, name: str, moment: float
) -> None:
    terminal = open_hapticd(*PARENTS[name])
    terminal.wait_until(moment)
    os.kill(terminal.pid, signal.SIGKILL)
    assert terminal.end().status == -signal.SIGKILL
    assert terminal.survivors() == []
    assert "Traceback" not in (tmp_path / "stderr.txt").read_text()
    for log in tmp_path.rglob("*.mcap"):  # the daemon makes it empty
        assert not log.stat().st_size or complete(log)


TIED = """
import subprocess, sys, time
from hapticd.runtime.live.children import tied
subprocess.Popen(["sleep", "60"], preexec_fn=tied())
print("started", flush=True)
time.sleep(60)
"""


POOLED = """
import time
from hapticd.experiments.workers import pool_of
if __name__ == "__main__":
    with pool_of(2) as pool:
        pool.submit(time.sleep, 0.0).result()
        print("started", flush=True)
        time.sleep(60)
"""


@pytest.mark.parametrize(
    ("program", "child"), [(TIED, "sleep 60"), (POOLED, "multiprocessing.forkserver")], ids=["tied", "worker"]
)
def test_a_child_dies_with_a_parent_that_is_killed(program: str, child: str) -> None:
    mark = f"tied-{os.getpid()}-{time.monotonic_ns()}"
    environment = {**os.environ, ENVIRONMENT: mark}
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, env=environment, text=True
    ) as parent:
        assert parent.stdout and parent.stdout.readline() == "started\n"
        assert [command for command in family(mark) if child in command]
        parent.kill()
    deadline = time.monotonic() + 10.0
    while family(mark) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert family(mark) == []


@pytest.mark.parametrize("moment", [1.0, 3.0])
def test_an_interrupted_benchmark_brings_its_daemon_s_machine_to_rest(
    open_hapticd: Open, tmp_path: Path, moment: float
) -> None:
    terminal = open_hapticd(*PARENTS["bench tick"])
    terminal.wait_until(moment)
    os.kill(terminal.pid, signal.SIGTERM)
    ended = terminal.end()
    assert ended.status == 128 + signal.SIGTERM
    assert ended.seconds < 6.0
    assert terminal.survivors() == []
    assert (tmp_path / "stderr.txt").read_text().endswith("hapticd: terminated\n")


@pytest.mark.parametrize("moment", [2.0, 3.5])
def test_an_interrupted_benchmark_with_workers_says_one_line(
    open_hapticd: Open, tmp_path: Path, moment: float
) -> None:
    terminal = open_hapticd("bench", "solve", "--every", "1")
    terminal.wait_until(moment)
    terminal.type(CTRL_C)
    ended = terminal.end()
    assert ended.status == 128 + signal.SIGINT
    assert ended.seconds < 3.0
    assert terminal.survivors() == []
    assert (tmp_path / "stderr.txt").read_text().count("hapticd: ") == 1
