"""What CONTRIBUTING.md shows as a diff applies to these sources, touches what it says, and works."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "CONTRIBUTING.md").read_text()
FOLDERS = [*tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["root_packages"]]
EXAMPLE = Path("examples/my_machine")

PROGRAMS = {
    "A device": """
from hapticd.configs import plugins
from hapticd.devices.bringup import Bringup, BringupState, Deadlines
from hapticd.devices.frames import Frames
from hapticd.devices.image import ProcessImage
from hapticd.devices.network import Network
from hapticd.sim.nodes import SimNodes
kind = plugins.plugin(plugins.DEVICES, "inclinometer")
network = Network([kind(name="tilt", node=1)])
image, nodes = ProcessImage(network), SimNodes(network)
bringup = Bringup(image, Deadlines.at(1e3))
answers, requests = Frames(), Frames()
for counter in range(100):
    image.latch(answers, counter - 1)
    requests.clear()
    bringup.step(answers, requests)
    image.compose(requests, counter, bringup.state is BringupState.READY)
    answers.clear()
    nodes.receive(requests, answers)
    nodes.advance(1e-3)
assert bringup.state is BringupState.READY
assert abs(image["inclinometers.acceleration"][0, 2] - 9.81) < 1e-5
""",
    "A twin": """
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.testing.bench import Bench
bench = Bench(config.load("pantograph"))
bench.until(Mode.ACTIVE, limit=5000)
puck = bench.cycle.machine.puck
assert type(puck).__name__ == "HomingPuck"
start = puck._home
puck.position += 0.01
for _ in range(5000):
    puck.push(0.0 * start, 1e-3)
assert abs(puck.position - start).max() < 1e-4
""",
    "A check": """
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.testing.bench import Bench
bench = Bench(config.load("rhi"))
bench.until(Mode.ENGAGING)
monitor, seen = bench.cycle.senses.monitor, bench.cycle.senses.seen
seen.wrench = [400.0, 0.0, 0.0, 0.0, 0.0, 0.0]
found = [monitor.judge(seen) for _ in range(60)]
assert [v.reason for v in found[:49]] == [""] * 49 and found[49].reason == "overload", found[45:52]
seen.armed = False
assert monitor.judge(seen).reason != "overload"
""",
    "A channel": """
from pathlib import Path
from hapticd.runtime.configuration import config
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay
lockstep_run.run(config.load("rhi"), Path("session.mcap"), 0.5, False)
assert {int(record.fixed["clamps"]) for record in open_log("session.mcap").records()} == {0}
assert replay(open_log("session.mcap")).differing_ticks == 0
""",
}
"""What must be so after the diff of a section."""


def diff(section: str) -> str:
    text = TEXT.partition(f"\n## {section}\n")[2].partition("\n## ")[0]
    (found,) = re.findall(r"```diff\n(.*?)```", text, re.DOTALL)
    return str(found)


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what is imported."""
    copy = tmp_path_factory.mktemp("sources") / "hapticd"
    for folder in (*(name.removeprefix("hapticd.") for name in FOLDERS), "examples"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("__init__.py", "pyproject.toml"):
        shutil.copy(ROOT / name, copy)
    return copy


def promise(path: Path, project: Path) -> None:
    """The entry points of a project, as its installation would leave them."""
    described = tomllib.loads((project / "pyproject.toml").read_text())["project"]
    info = path / f"{described['name'].replace('-', '_')}_copy-0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {described['name']}-copy\nVersion: 0\n")
    groups = {group: points for group, points in described["entry-points"].items() if group != "pytest11"}
    lines = [
        line
        for group, points in groups.items()
        for line in (f"[{group}]", *(f"{name} = {value}" for name, value in points.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")


def run(section: str, copy: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """The program of a section, with a copy of the sources and of the example."""
    promise(folder, copy)
    promise(folder, copy / EXAMPLE)
    path = os.pathsep.join(map(str, (folder, copy.parent, copy / EXAMPLE)))
    command = [sys.executable, "-c", PROGRAMS[section]]
    variables = {**os.environ, "PYTHONPATH": path}
    return subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("section", PROGRAMS)
def test_a_diff_touches_little_applies_and_does_what_it_is_for(
    sources: Path, tmp_path: Path, section: str
) -> None:
    shown = diff(section)
    new = len(re.findall(r"^--- /dev/null$", shown, re.MULTILINE))
    files = len(re.findall(r"^\+\+\+ ", shown, re.MULTILINE))
    assert new <= (2 if section == "A device" else 1) and files - new <= 1
    copy = tmp_path / "hapticd"
    shutil.copytree(sources, copy)
    patch = ["patch", "-p1", "--fuzz=0", "--batch"]
    applied = subprocess.run(patch, input=shown, cwd=copy, capture_output=True, text=True, check=False)
    assert applied.returncode == 0, applied.stdout
    done = run(section, copy, tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("section", PROGRAMS)
def test_without_its_diff_a_program_fails(sources: Path, tmp_path: Path, section: str) -> None:
    assert run(section, sources, tmp_path).returncode != 0
