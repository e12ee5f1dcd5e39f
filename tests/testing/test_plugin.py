"""The pytest plugin: without a machine it costs nothing, with one it runs the suite."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

TRIVIAL = "def test_nothing() -> None: pass\n"


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Pytest in a folder of somebody's."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_without_a_machine_nothing_but_the_plugin_is_loaded(tmp_path: Path) -> None:
    (tmp_path / "test_theirs.py").write_text(
        "import sys\n"
        "def test_light() -> None:\n"
        "    ours = {name for name in sys.modules if name.startswith('hapticd')}\n"
        "    assert ours <= {'hapticd', 'hapticd.testing', 'hapticd.testing.plugin'}, ours\n"
        "    assert 'numpy' not in sys.modules\n"
    )
    done = run(tmp_path)
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout


def collected(done: subprocess.CompletedProcess[str]) -> list[str]:
    return [line for line in done.stdout.splitlines() if "::" in line]


def test_a_machine_alone_runs_the_suite_and_with_a_path_both(tmp_path: Path) -> None:
    (tmp_path / "test_theirs.py").write_text(TRIVIAL)
    alone = collected(run(tmp_path, "--collect-only", "--hapticd-machine", "rhi"))
    assert len(alone) > 100 and all("rhi" in name for name in alone)
    both = collected(run(tmp_path, "--collect-only", "--hapticd-machine", "rhi", "test_theirs.py"))
    assert len(both) == len(alone) + 1
    two = ["--hapticd-machine", "rhi", "--hapticd-machine", "giant"]
    names = collected(run(tmp_path, "--collect-only", *two))
    assert len(names) > len(alone) and set(alone) < set(names)
    assert any("imu_handle" in name for name in names)


def test_a_project_may_always_include_its_machines(tmp_path: Path) -> None:
    (tmp_path / "pytest.ini").write_text("[pytest]\nhapticd_machines = rhi\n")
    (tmp_path / "test_theirs.py").write_text(TRIVIAL)
    names = collected(run(tmp_path, "--collect-only"))
    assert len(names) > 100 and any("test_theirs" in name for name in names)
    assert len(collected(run(tmp_path, "--collect-only", "test_theirs.py"))) == 1


def test_what_is_not_a_machine_is_refused_before_anything_runs(tmp_path: Path) -> None:
    done = run(tmp_path, "--hapticd-machine", "gaint")
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert 'did you mean "giant"?' in done.stderr


SABOTAGE = {
    # what is broken: (how, which tests of the suite must see it)
    "brakes that push": (
        "from hapticd.machines.rhi.machine import RedundantInterface as Machine\n"
        "brake = Machine.brake\n"
        "def pushes(self, dropped):\n"
        "    done = brake(self, dropped)\n"
        "    self.commands = [3.0 if v > 0.0 else -3.0 for v in self.velocity]\n"
        "    return done\n"
        "Machine.brake = pushes\n",
        "moves and dead-man",
    ),
    "a gate that lets everything pass": (
        "from dataclasses import replace\n"
        "from math import inf\n"
        "from hapticd.safety import Gate\n"
        "ready = Gate.__init__\n"
        "wide = {'command': inf, 'step': inf, 'power': inf, 'lower': -inf, 'upper': inf, 'peak': None}\n"
        "def passes(self, axes, *rest):\n"
        "    ready(self, [replace(axis, **wide) for axis in axes], *rest)\n"
        "Gate.__init__ = passes\n",
        "beyond_its_limit_is_cut",
    ),
    "a monitor that does not look at people": (
        "from hapticd.safety import monitor\n"
        "blind = monitor.Check(lambda seen: monitor.PASS)\n"
        "monitor.CHECKS['14 to 16'] = monitor.Row(lambda t, trust: blind)\n",
        "engages and dead-man",
    ),
    "a session that depends on the time": (
        "import time\n"
        "from hapticd.machines.rhi.machine import RedundantInterface as Machine\n"
        "update = Machine.update\n"
        "def late(self, gain, trust):\n"
        "    update(self, gain, trust)\n"
        "    self.commands[0] += 1e-3 * (time.monotonic_ns() % 7)\n"
        "Machine.update = late\n",
        "same_in_every_bit",
    ),
    "nobody who watches what should stand": (
        "from hapticd.safety import Standstill\nStandstill.moved = lambda *_: -1\n",
        "brake_that_slips and motor_1",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SABOTAGE)
def test_the_suite_finds_what_is_broken(tmp_path: Path, name: str) -> None:
    program, tests = SABOTAGE[name]
    whole = run(tmp_path, "--hapticd-machine", "rhi", "-k", tests, "-x")
    assert whole.returncode == 0, whole.stdout
    (tmp_path / "conftest.py").write_text(program)
    broken = run(tmp_path, "--hapticd-machine", "rhi", "-k", tests, "-x")
    assert broken.returncode == pytest.ExitCode.TESTS_FAILED, broken.stdout


NOTES_WHO_RUNS_WHAT = """
import os
def pytest_runtest_protocol(item):
    with open(os.environ["PYTEST_XDIST_WORKER"], "a") as notes:
        notes.write(item.nodeid + "\\n")
    return True
"""


def test_of_several_processes_one_runs_every_live_test_and_first(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(NOTES_WHO_RUNS_WHAT)
    makefile = (Path(__file__).parents[2] / "Makefile").read_text()
    (several,) = re.findall(r"^SEVERAL := -n auto (.*)$", makefile, re.MULTILINE)
    run(tmp_path, "-n", "2", *several.split(), "--hapticd-machine", "rhi", "--hapticd-machine", "giant")
    notes = [(tmp_path / worker).read_text().splitlines() for worker in ("gw0", "gw1")]
    assert sum(map(len, notes)) > 300
    live = [["live.py::" in name for name in names] for names in notes]
    theirs, others = sorted(live, key=any, reverse=True)
    assert sum(theirs) > 10 and theirs == sorted(theirs, reverse=True)
    assert not any(others)
