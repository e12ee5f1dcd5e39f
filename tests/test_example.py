"""The package of examples/my_machine: installed elsewhere, it runs in lockstep, live and in the suite."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hapticd.testing.terminal import HAPTICD

EXAMPLE = Path(__file__).parent.parent / "examples" / "my_machine"
MOST_LINES = 300
pytestmark = pytest.mark.slow


def call(folder: Path, *command: str) -> str:
    """What a command says; it must succeed."""
    done = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder / "installed")},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def pytest_of(folder: Path, *arguments: str) -> str:
    return call(folder, sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the package is installed, in a folder ``installed`` of its own, and somebody works with it."""
    folder = tmp_path_factory.mktemp("example")
    shutil.copytree(EXAMPLE, folder / "source", ignore=shutil.ignore_patterns("build", "*.egg-info"))
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps"]
    call(folder, *pip, "--no-build-isolation", "--target", "installed", "./source")
    return folder


def test_hapticd_knows_it_only_where_it_is_installed(folder: Path, tmp_path: Path) -> None:
    assert "4 devices" in call(folder, *HAPTICD, "check", "pantograph")
    check = [*HAPTICD, "check", "pantograph"]
    assert subprocess.run(check, cwd=tmp_path, capture_output=True, check=False).returncode == 2


def test_it_is_small_and_its_own_tests_pass(folder: Path) -> None:
    lines = sum(len(path.read_text().splitlines()) for path in EXAMPLE.glob("*/*.py"))
    assert lines <= MOST_LINES
    assert "2 passed" in pytest_of(folder, "source/tests")


def test_it_runs_in_lockstep_into_its_wall_and_replays(folder: Path) -> None:
    said = call(folder, *HAPTICD, "run", "pantograph", "--lockstep", "--log", "lockstep.mcap")
    assert "1 of 1 limits touched" in said
    assert " 0 differ" in call(folder, *HAPTICD, "replay", "lockstep.mcap", "--verify")


def test_it_runs_live_and_replays(folder: Path) -> None:
    call(folder, *HAPTICD, "run", "pantograph", "--duration", "4", "--log", "live.mcap")
    assert " 0 differ" in call(folder, *HAPTICD, "replay", "live.mcap", "--verify")


@pytest.mark.parametrize("which", ["not live", "live"])
def test_it_passes_the_conformance_suite(folder: Path, which: str) -> None:
    said = pytest_of(folder, "--hapticd-machine", "pantograph", "-m", which)
    assert " passed" in said and "skipped" not in said
