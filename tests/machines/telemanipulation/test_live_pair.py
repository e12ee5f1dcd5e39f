"""Both stations live: where one of them is refused or killed, the other one ends, too."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest
from hapticd.configs import read_text
from hapticd.machines.telemanipulation import live_pair
from hapticd.runtime.errors import ConfigError

pytest.importorskip("cryptography")
STATION = """
import os, pathlib, signal, sys, time
station, log = pathlib.Path(sys.argv[2]).stem, pathlib.Path(sys.argv[4])
if station == "operator":
    while not log.with_name("avatar.mcap").exists():
        time.sleep(0.01)
    {operator}
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
log.touch()
print(station, "was asked to end" if signal.sigtimedwait([signal.SIGTERM], 20) else "was left alone")
sys.exit(143)
"""
"""A station's process, which runs until it is asked to end; the operator's first does what a test says."""


@pytest.mark.parametrize(
    ("operator", "status"),
    [("sys.exit(2)", 2), ("log.touch(); os.kill(os.getpid(), signal.SIGKILL)", 128 + signal.SIGKILL)],
    ids=["refused", "killed"],
)
def test_nobody_is_left_alone(
    operator: str,
    status: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    program = tmp_path / "station.py"
    program.write_text(STATION.format(operator=operator), encoding="utf-8")
    monkeypatch.setattr(live_pair, "HAPTICD", (sys.executable, os.fspath(program)))
    logs = [tmp_path / f"{station}.mcap" for station in live_pair.NAMES]
    assert live_pair.live_pair("operator", "avatar", None, logs, as_json=False) == status
    assert "--- avatar\navatar was asked to end\n" in capsys.readouterr().out


def test_a_configuration_is_refused_by_its_own_file_before_anything_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_pair, "HAPTICD", ("/nothing/begins",))
    mine = tmp_path / "mine.toml"
    mine.write_text(read_text("operator.toml").replace('rate = "1 kHz"', 'rate = "250 Hz"'), encoding="utf-8")
    (tmp_path / "bimanual.urdf").write_text(read_text("bimanual.urdf"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"mine\.toml:\d+.*cues are not told apart"):
        live_pair.live_pair(str(mine), "avatar", None, [tmp_path / "a", tmp_path / "b"], as_json=False)
