"""`hapticd init` writes what `hapticd check` accepts, and overwrites nothing."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from hapticd.machines.arm.init import Made, init
from hapticd.runtime.command_line.cli import main

from .arms import gripper, planar, random_arm, scara


def made(text: str) -> Made:
    return init(text, "x.urdf", None, "x.toml", "x.clean.urdf")


@pytest.mark.parametrize("text", [planar, scara, gripper])
def test_what_is_written_is_accepted_and_always_the_same(text: Callable[[], str]) -> None:
    first = made(text())
    assert first == made(text())
    assert all(f"# * {remark}" in first.toml for remark in first.remarks)


@pytest.mark.parametrize("seed", range(8, 14))
def test_any_arm_gets_a_configuration(seed: int) -> None:
    found = made(random_arm(seed))
    assert 3 <= len(found.joints) <= 7 and len(found.directions) <= len(found.joints)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "planar.urdf").write_text(planar())
    return tmp_path


def test_the_command_writes_two_files_that_the_others_take(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", "planar.urdf"]) == 0
    assert "planar.toml and planar.clean.urdf are written: 3 joints, x, y, rz" in capsys.readouterr().out
    assert main(["check", "planar.toml"]) == 0
    before = (folder / "planar.toml").read_text()
    assert main(["init", "planar.urdf"]) == 2
    assert "planar.toml exists already" in capsys.readouterr().err
    assert (folder / "planar.toml").read_text() == before


def test_the_command_speaks_json(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "planar.urdf", "--tip", "hand", "--out", "mine.toml", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["config"] == "mine.toml" and said["joints"] == ["q1", "q2", "q3"]
    assert (folder / said["model"]).exists()


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["nothing.urdf"], "nothing.urdf is no file"),
        (["planar.urdf", "--out", "x.json"], "ends in .toml"),
        (["planar.urdf", "--out", "no/x.toml"], "'no' is not a folder"),
        (["planar.urdf", "--tip", "x"], "there is no link 'x'"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_is_written(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], problem: str
) -> None:
    try:
        status = main(["init", *words])
    except SystemExit as usage:  # argparse
        status = int(usage.code or 0)
    assert status == 2
    assert problem in capsys.readouterr().err
    assert [path.name for path in folder.iterdir()] == ["planar.urdf"]
