"""Both stations with a task: the person at the operator's arms handles what is at the avatar's."""

import json
import sys
from pathlib import Path

import pytest
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay


def test_a_session_with_a_scene_is_recorded_replays_and_says_what_became_of_the_task(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco", reason="the extra `scene` is not installed")
    words = ["bimanual", "--scene", "peg", "--duration", "0.5", "--logs", str(tmp_path / "peg"), "--json"]
    assert main(words) == 0
    said = json.loads(capsys.readouterr().out)["scene"]
    assert said["success"] is False and said["seconds"] is None
    assert 0.0 < said["largest_force_n"] < 5.0
    for station in ("operator", "avatar"):
        found = replay(open_log(str(tmp_path / f"peg-{station}.mcap")))
        assert found.ticks > 400 and found.differing_ticks == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [(["--live"], "a scene runs in lockstep"), ([], "pip install 'mujoco")],
)
def test_a_scene_that_cannot_be_is_refused(
    words: list[str],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert main(["bimanual", "--scene", "peg", "--logs", str(tmp_path / "x"), *words]) == 2
    assert said in capsys.readouterr().err
