"""Commands that are proposed to a person, as they have to be typed where that person stands."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from hapticd.runtime import invocation

ROOT = Path(__file__).parents[2]
SOURCES = [
    path
    for folder in ("bench", "control", "devices", "experiments", "hqp", "models", "runtime", "safety", "sim")
    for path in (ROOT / folder).rglob("*.py")
]


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An environment with the program and an interpreter, which the PATH does not lead to."""
    binaries = tmp_path / "my env" / "bin"
    binaries.mkdir(parents=True)
    for name in ("hapticd", "python"):
        (binaries / name).touch(mode=0o755)
    monkeypatch.setattr(sys, "prefix", str(binaries.parent))
    monkeypatch.setattr(sys, "executable", str(binaries / "python"))
    monkeypatch.setenv("PATH", "/usr/bin")
    return binaries


def test_the_program_is_named_as_the_shell_finds_it(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir("/usr")
    assert invocation.program() == f"'{installed / 'hapticd'}'"
    monkeypatch.chdir(tmp_path)
    assert invocation.program() == "'my env/bin/hapticd'"
    assert invocation.install("numpy") == "'my env/bin/python' -m pip install 'numpy>=2'"
    monkeypatch.setenv("PATH", str(installed))
    assert invocation.program() == "hapticd"
    (installed / "hapticd").unlink()
    assert invocation.program() == "python -m hapticd.runtime"


def test_another_program_of_that_name_on_the_path_is_not_taken_for_this_one(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "other"
    other.mkdir()
    (other / "hapticd").touch(mode=0o755)
    monkeypatch.setenv("PATH", str(other))
    monkeypatch.chdir("/usr")
    assert invocation.program() == f"'{installed / 'hapticd'}'"


def test_the_program_and_pip_run_as_proposed_here() -> None:
    for command in (invocation.program(), f"{invocation.python()} -m pip"):
        subprocess.run(f"{command} --version", shell=True, check=True, capture_output=True, timeout=60)


def test_packages_are_proposed_in_the_version_that_the_program_asks_for() -> None:
    proposed = invocation.install("matplotlib", "daqp", "unheard-of")
    assert proposed.startswith(f"{invocation.python()} -m pip install ")
    assert proposed.endswith(" 'matplotlib>=3.9' daqp==0.11.0 unheard-of")


def test_no_message_proposes_the_program_or_pip_as_if_they_were_on_the_path() -> None:
    bare = re.compile(
        r"pip install [^{]|(?:type|try|replay|run|is|by)[:;]? (?:sudo )?hapticd [a-z]", re.IGNORECASE
    )
    for path in SOURCES:
        if path.name != "invocation.py":
            assert not bare.search(path.read_text()), path


def test_what_lies_in_the_folder_one_stands_in_is_not_part_of_the_program(tmp_path: Path) -> None:
    (tmp_path / "json.py").write_text("raise SystemExit('somebody else')\n")
    (tmp_path / "hapticd.egg-info").mkdir()
    (tmp_path / "hapticd.egg-info" / "PKG-INFO").write_text("Name: hapticd\nVersion: 0.0.1\n")
    command = [str(Path(sys.executable).with_name("hapticd")), "check", "giant"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
