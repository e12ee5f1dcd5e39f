"""A session is recorded, replays bit for bit, and is the same again with the same seed."""

from __future__ import annotations

from pathlib import Path

import pytest

from ...runtime.live import lockstep_run
from ...runtime.recording.log import open_log
from ...runtime.recording.replay import replay
from ..cases import load

RENDERED_S = 0.3
"""Time for which the twin is rendered after it has faded in."""


def record(name: str, path: Path) -> None:
    """The session that is configured, until some ticks of the twin are rendered."""
    loaded = load(name)
    assert loaded.config.simulation is not None
    pressed = [float(press.at) for press in loaded.config.simulation.hand.dead_man if press.pressed]
    begin = pressed[0] if pressed else 0.0
    done = lockstep_run.run(loaded, path, begin + loaded.config.arming.fade + RENDERED_S, False)
    assert done.status == 0, done.message


@pytest.fixture(scope="module")
def recording(machine_name: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session in lockstep."""
    path = tmp_path_factory.mktemp("recording") / "session.mcap"
    record(machine_name, path)
    return path


def test_a_replay_is_the_same_in_every_bit(recording: Path) -> None:
    found = replay(open_log(str(recording)))
    assert found.ticks > 0
    assert (found.differing_ticks, found.first) == (0, [])


def test_the_same_seed_gives_the_same_file(recording: Path, machine_name: str, tmp_path: Path) -> None:
    again = tmp_path / "again.mcap"
    record(machine_name, again)
    assert again.read_bytes() == recording.read_bytes()
