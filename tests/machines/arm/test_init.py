"""`hapticd init` writes what `hapticd check` accepts, and overwrites nothing."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hapticd.devices.force_torque import ForceTorque
from hapticd.machines.arm.config import ArmConfig
from hapticd.machines.arm.errors import InitError
from hapticd.machines.arm.init import Made, init
from hapticd.machines.arm.machine import foreseen_limits
from hapticd.machines.rendering.surroundings import check_pairs, unwatched, watched
from hapticd.models import Robot
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.config import parse

from .arms import gripper, planar, random_arm, scara


def made(text: str) -> Made:
    return init(text, "x.urdf", None, "x.toml", "x.clean.urdf")


@pytest.mark.parametrize("text", [planar, scara, gripper])
def test_what_is_written_is_accepted_and_always_the_same(text: Callable[[], str]) -> None:
    first = made(text())
    assert first == made(text())
    said = first.toml.replace("\n#   ", " ")
    assert all(f"# * {remark}" in said for remark in first.remarks)


def test_primitives_for_collisions_are_kept_and_watched() -> None:
    shape = '<collision><origin xyz="0.2 0 0.1"/><geometry><box size="0.3 0.1 0.08"/></geometry></collision>'
    text = planar()
    for name in ("upper", "fore", "hand"):
        at = text.index("</link>", text.index(f'<link name="{name}">'))
        text = text[:at] + shape + text[at:]
    found = made(text)
    described = Robot.from_urdf(found.urdf, "x.clean.urdf").shapes
    assert [(each.link, each.kind) for each in described] == [
        *((name, "box") for name in ("upper", "fore", "hand")),
        ("handle", "cylinder"),
    ]
    np.testing.assert_allclose(described[1].T[:3, 3], [0.2, 0.0, 0.1])
    assert described[1].size == (0.3, 0.1, 0.08)
    config = parse(found.toml, "x.toml")
    assert isinstance(config, ArmConfig) and config.look_ahead
    robot = Robot.from_urdf(found.urdf, "x.clean.urdf")
    limits = foreseen_limits(config, robot)
    pairs, _ = watched(robot, config.look_ahead, limits)
    assert ("hand", "upper") in [(first.name, second.name) for first, second in pairs]
    # a box lies within its capsule: its corners do
    first = next(first for first, _ in pairs if first.name == "hand")
    corners = np.array([0.2, 0.0, 0.1]) + np.array([0.15, 0.05, 0.04]) * np.array(
        list(product((-1, 1), repeat=3))
    )
    way = first.b - first.a
    for corner in corners:
        nearest = first.a + np.clip((corner - first.a) @ way / (way @ way), 0.0, 1.0) * way
        assert np.linalg.norm(corner - nearest) <= first.radius + 1e-12
    assert unwatched(robot, config.look_ahead, limits) == []
    assert check_pairs(robot, config.look_ahead) == []
    robot.shapes *= 30
    ((key, problem, _),) = check_pairs(robot, config.look_ahead)
    assert key == "look_ahead" and "at most 1024" in problem


@pytest.mark.parametrize("seed", range(8, 14))
def test_any_arm_gets_a_configuration(seed: int) -> None:
    found = made(random_arm(seed))
    assert 3 <= len(found.joints) <= 7 and len(found.directions) <= len(found.joints)


def test_long_names_and_odd_characters_make_no_long_lines() -> None:
    text = planar().replace("upper", "upper" + "_" * 85).replace("fore", "f\u202e\u00e9" + "-" * 900)
    found = made(text)
    assert max(map(len, found.toml.splitlines())) < 200
    assert "\u202e" not in found.toml and "\u00e9" in found.toml


def grown(text: str, lengths: float, masses: float) -> str:
    """The same arm in another size, with motors in proportion."""
    root = ET.fromstring(text)
    for origin in root.iter("origin"):
        origin.set("xyz", " ".join(str(lengths * float(x)) for x in origin.attrib["xyz"].split()))
    for mass in root.iter("mass"):
        mass.set("value", str(masses * float(mass.attrib["value"])))
    for inertia in root.iter("inertia"):
        for key, value in inertia.attrib.items():
            inertia.set(key, str(masses * lengths**2 * float(value)))
    for limit in root.iter("limit"):
        limit.set("effort", str(masses * lengths * float(limit.attrib["effort"])))
    return ET.tostring(root, encoding="unicode")


@pytest.mark.parametrize(
    ("text", "size", "problem"),
    [
        (
            gripper,
            (10.0, 30.0),
            "x.urdf: the joint 'l2' carries too much: it needs .* N m to hold the arm, at most",
        ),
        (planar, (10.0, 400.0), "x.urdf: the joint 'q1' moves too much: .* kg m.2 and more"),
        (scara, (0.08, 0.002), "x.urdf: the joint '.*' is too weak: with .* it bears .* N at the handle"),
        (planar, (60.0, 1.0), "x.urdf: .*0 to 20 m: a hall"),
    ],
)
def test_arms_beyond_what_a_machine_can_be_are_refused_by_their_own_names(
    text: Callable[[], str], size: tuple[float, float], problem: str
) -> None:
    with pytest.raises(InitError, match=problem) as refused:
        made(grown(text(), *size))
    assert not re.search(r"toml|clean|:\d", str(refused.value))


def test_guesses_end_where_machines_do() -> None:
    found = made(grown(gripper(), 2.2, 10.0))
    efforts = [float(value) for value in re.findall(r'effort="(.*?)"', found.urdf)]
    brakes = [float(value) for value in re.findall(r'brake = "(.*?) N m"', found.toml)]
    assert 1500.0 < max(efforts) <= 2000.0 and max(brakes) == 2000.0


@pytest.mark.parametrize("text", [planar, scara, gripper])
def test_the_hand_is_led_to_what_is_promised_and_the_sensor_is_made_for_it(text: Callable[[], str]) -> None:
    found = made(text())
    config = parse(found.toml, "x")
    assert isinstance(config, ArmConfig) and config.simulation
    sensor, hand, (box,) = config.devices["force_torque"], config.simulation.hand, config.arm.boxes or ()
    assert isinstance(sensor, ForceTorque) and sensor.force >= 10.0 * hand.force
    assert sensor.force <= 10.0 * max(hand.force, 3.0 * config.arm.handle.mass)
    places = np.array([point.position for point in hand.path])
    assert len(config.simulation.touches) == sum(name in "xyz" for name in found.directions)
    for name, side in config.simulation.touches.items():
        i = "xyz".index(name.removeprefix("handle "))
        beyond = places[:, i].max() - box.upper[i] if side == "upper" else box.lower[i] - places[:, i].min()
        assert beyond == pytest.approx(0.06, abs=1e-4)


def test_a_full_disk_is_named_and_leaves_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Path.open

    def full(path: Path, *arguments: str, **more: str) -> object:
        if path.suffix != ".toml" or "x" not in arguments:
            return kept(path, *arguments, **more)  # type: ignore[call-overload]
        path.touch()
        return kept(Path("/dev/full"), "w", **more)  # type: ignore[call-overload]

    monkeypatch.setattr(Path, "open", full)
    assert main(["init", "planar.urdf"]) == 2
    assert "planar.toml cannot be written: No space left on device" in capsys.readouterr().err
    assert [path.name for path in folder.iterdir()] == ["planar.urdf"]


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
        (["."], "is a folder; give the robot's URDF"),
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
