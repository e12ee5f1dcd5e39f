"""A recording keeps the mesh of a body: it replays where the file is another, or gone."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.recording.log import open_log
from hapticd.testing.terminal import HAPTICD

from ..machines.rhi import meshes

BALL = read_text("panda_rhi.toml").partition("[rhi.bodies.ball]")[2].partition("[rhi.hold]")[0]
ORGAN = """
kind = "solid"
mesh = "organ.stl"
unit = "mm"
point = "0.42 -0.1 0.36 m"
stiffness = "1000 N/m"
damping = "5 N s/m"

"""
"""A ball that the hand comes into 5.4 s after the beginning, 1 cm deep."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a folder that is gone since."""
    folder = tmp_path_factory.mktemp("machine")
    text = read_text("panda_rhi.toml").replace(BALL, ORGAN).replace("scan = 2000", "scan = 60")
    (folder / "organ_machine.toml").write_text(text)
    (folder / "panda.urdf").write_text(read_text("panda.urdf"))
    (folder / "organ.stl").write_bytes(meshes.binary_stl(meshes.ball(3, 0.05)))
    log = tmp_path_factory.mktemp("log") / "session.mcap"
    words = ["run", str(folder / "organ_machine.toml"), "--lockstep", "--duration", "6", "--log", str(log)]
    done = subprocess.run([*HAPTICD, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr + done.stdout
    shutil.rmtree(folder)
    return log


@pytest.mark.slow
def test_a_session_feels_the_mesh(recording: Path) -> None:
    states = [r.fixed["state"] for r in open_log(str(recording)).records() if r.fixed["mode"] == Mode.ACTIVE]
    demand = np.linalg.norm([state["demand"] for state in states], axis=1)
    assert 5.0 < demand.max() < 15.0


@pytest.mark.slow
def test_it_replays_without_the_files(recording: Path) -> None:
    """In a process that has not read them."""
    words = ["replay", str(recording), "--verify"]
    done = subprocess.run([*HAPTICD, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr + done.stdout
    assert " 0 differ" in done.stdout
