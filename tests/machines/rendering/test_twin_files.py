"""A twin's file takes the place of a machine's twin; what is wrong with it is said with file, key and fix."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.control.chain import FREE
from hapticd.experiments.random_hand import Temper, stranger
from hapticd.machines.giant.system import GIANT
from hapticd.machines.rendering.figures import RenderingFigures
from hapticd.machines.rendering.twin import check_twins
from hapticd.models import Robot
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.configuration.twin_file import exchanged
from hapticd.runtime.core.modes import MOST_TWINS, Mode
from hapticd.runtime.errors import ConfigError
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.live.promise import verdict
from hapticd.sim.hand import hanging

DOCUMENT = (Path(__file__).parents[3] / "docs" / "twins.md").read_text()
(DRAWER,) = re.findall(r"```toml\n(.*?)```", DOCUMENT, re.DOTALL)


def written(folder: Path, text: str) -> str:
    path = folder / "my_twin.toml"
    path.write_text(text)
    return f"giant with {path}"


def test_the_twin_of_the_manual_is_short_and_does_what_it_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert len([line for line in DRAWER.splitlines() if line.strip()]) <= 30
    name = written(tmp_path, DRAWER)
    assert main(["check", "giant", "--twin", name.removeprefix("giant with ")]) == 0
    assert "no findings" in capsys.readouterr().out
    loaded = config.load(name)
    outcome = lockstep_run.run(loaded, tmp_path / "log.mcap", 11.0, live=False)
    assert outcome.report is not None and outcome.status == 0, outcome.message
    shown, line = verdict(loaded, outcome.report, lockstep=True)
    assert shown and "1 of 1 limits touched" in line, line
    rows = {row.name: row for row in outcome.report.limits}
    assert rows["twin drawer"].upper == 0.3 and rows["twin knob"].unit == "rad"


def test_a_session_with_another_twin_is_named_after_both_and_replays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "giant", "--twin", "panda", "--lockstep", "--duration", "1"]) == 0
    (log,) = (tmp_path / "log").glob("giant_panda-*.mcap")
    assert "twin joint 4" in capsys.readouterr().out
    assert main(["replay", str(log), "--verify"]) == 0


def test_random_hands_repeat_the_worst_session_with_its_twin(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["hands", "giant", "--twin", "door", "--count", "1", "--seconds", "1"]) == 0
    said = capsys.readouterr().out
    assert "hands giant --twin door --count 1 --seed 1 --seconds 1.0" in said and "twin hinge" in said


def test_the_log_names_the_joints_and_the_live_line_says_which_are_locked() -> None:
    session = build(config.load("giant with door"))
    machine = session.cycle.machine
    state = np.zeros(1, machine.state)
    machine.bind_state(state)
    machine.fill()
    assert state["twin"].dtype.names == ("hinge", "handle")
    assert state["twin"]["handle"] == -0.05
    line = session.system.figures(session.config).live(session.cycle.mode.ACTIVE, state[0])
    assert line[1:] == ["hinge 0.00 rad locked", "handle -0.05 rad"]
    assert [spec.name for spec in session.system.limits(session.config).specs][-2:] == [
        "twin hinge",
        "twin handle",
    ]


def test_people_read_names_of_joints_in_words() -> None:
    joints = [("avatar_right_joint_1", "<f8")]
    state = np.zeros(1, [("wrench", "<f8", 6), ("spent", "u1", 1), ("twin", joints), ("held", "u1", 1)])
    state["held"], state["twin"] = FREE, -1e-4
    assert RenderingFigures(["rad"]).live(Mode.ACTIVE, state[0]) == [
        "force 0 N",
        "avatar right joint 1 0.00 rad",
    ]


def test_the_free_mass_of_a_file_is_the_giants_own() -> None:
    one, other = config.load("giant"), config.load("giant with mass")
    assert one.config == other.config


def test_a_twin_may_stand_in_the_machines_own_file(tmp_path: Path) -> None:
    own = exchanged(read_text("giant.toml"), read_text("twins/panda.toml"), "giant", touches=False)
    (tmp_path / "mine.toml").write_text(own)
    for name in ("giant.urdf", "panda.urdf"):
        (tmp_path / name).write_text(read_text(name))
    loaded = config.load(str(tmp_path / "mine.toml"))
    build(loaded)
    settings: Any = loaded.config
    assert settings.giant.twin.kept.urdf.strip() == read_text("panda.urdf").strip()
    # a recording keeps the text alone, and it is enough
    again = replace(loaded, config=config.parse(loaded.text, loaded.source))
    assert again.config == loaded.config


def test_an_arm_renders_chains_where_it_has_six_directions(tmp_path: Path) -> None:
    loaded: Any = config.load("panda with excavator")
    build(loaded)
    assert len(loaded.config.simulation.hand.path) > 100
    text = loaded.text.replace('["x", "y", "z", "rx", "ry", "rz"]', '["x", "y", "z"]')
    with pytest.raises(ConfigError, match=r"arm\.twin\.kind: the end of a chain moves in six directions"):
        build(replace(loaded, config=config.parse(text, loaded.source), text=text))


def test_the_hand_of_a_script_is_where_the_joints_lead() -> None:
    loaded: Any = config.load("giant with door")
    hand = loaded.config.simulation.hand
    first = hand.path[0]
    robot = Robot.from_urdf(loaded.model_text, "giant.urdf")
    plant = loaded.config.simulation.giant
    T = robot.placement(np.array([*plant.ppu, *plant.posture]), "handle")
    np.testing.assert_allclose(first.position, T[:3, 3], atol=1e-5)
    np.testing.assert_allclose(hanging(first.angles, (0.0,) * 3)[0], T[:3, :3], atol=1e-4)
    ways = np.array([point.position for point in hand.path])
    hinge = T[:3, 3] + [0.0, 0.8 - 0.12 * np.cos(0.05), 0.0]  # a leaf's width to the side
    far = np.hypot(*(ways - hinge)[:, :2].T)
    assert far.min() > 0.67 and far.max() < 0.8 - 0.12 * np.cos(0.55) + 1e-4
    assert [(pause.at, pause.seconds) for pause in hand.away] == [(16.8, 5.0)]


@pytest.mark.parametrize("twin", ["door", "excavator", "panda"])
def test_random_hands_lead_the_joints_beyond_their_limits(twin: str) -> None:
    loaded: Any = config.load(f"giant with {twin}")
    robot = Robot.from_urdf(loaded.model_text, "giant.urdf")
    found: Any = stranger(loaded.config, GIANT, robot, 3, 20.0, Temper())
    assert found == stranger(loaded.config, GIANT, robot, 3, 20.0, Temper())
    hand = found.simulation.hand
    assert hand.away is None and not found.simulation.touches
    angles = np.array([point.angles for point in hand.path])
    assert np.abs(np.diff(angles, axis=0)).max() < np.pi  # no turn is jumped over
    build(replace(loaded, config=found))


def test_several_twins_are_named_by_their_files_and_each_is_read_whole(tmp_path: Path) -> None:
    (tmp_path / "My-Drawer.toml").write_text(DRAWER)
    loaded: Any = config.load(f"panda with door,{tmp_path / 'My-Drawer.toml'},panda,mass")
    assert loaded.config.twin_names == ("door", "my_drawer", "panda", "mass")
    assert loaded.config.arm.twin == msgspec.structs.replace(
        config.load("panda with door").config.arm.twin,
        name="door",  # type: ignore[attr-defined]
    )
    assert loaded.config.arm.twins["panda"].kept.urdf.strip() == read_text("panda.urdf").strip()
    names = build(loaded).cycle.machine.state["twin"].names
    assert names is not None and names[:4] == ("hinge", "handle", "my_drawer_drawer", "my_drawer_knob")
    # a recording keeps the text alone, and it is enough
    assert config.parse(loaded.text, loaded.source) == loaded.config
    assert config.load("panda with door").config.twin_names == ("chain",)


TWINS_WRONG = [
    ("door,door", "two twins would be called 'door'"),
    ("door,doors", 'did you mean "door"'),
    ("door,", "no such file or built-in twin"),
    ("mass,{}", "my_twin.toml:18: twin.joints.knob.velocity"),
]


@pytest.mark.parametrize(("several", "told"), TWINS_WRONG)
def test_what_is_wrong_with_one_of_several_is_said(tmp_path: Path, several: str, told: str) -> None:
    path = tmp_path / "my_twin.toml"
    path.write_text(DRAWER.replace('velocity = "4 rad/s"', 'velocity = "4 rad"'))
    with pytest.raises(ConfigError) as error:
        config.load(f"giant with {several.format(path)}")
    assert told in str(error.value)


OWN_WRONG = [
    ('name = "mass"', 'name = "door"', "giant.twins.door: is also the name of the twin of the start"),
    ('name = "mass"', 'name = "my mass"', "giant.twin.name"),
    (
        "[giant.twins.door]",
        '[giant.twins.door]\nname = "gate"',
        "giant.twins.door.name: 'gate' is not",
    ),
    ("giant.twins.door", "giant.twins.Door", "giant.twins"),
    ('"0 1.2 rad"', '"1.2 0 rad"', "giant.twins.door.joints.hinge.range"),
]


@pytest.mark.parametrize(("old", "new", "told"), OWN_WRONG)
def test_what_is_wrong_with_twins_of_a_machines_own_file_is_said(old: str, new: str, told: str) -> None:
    loaded = config.load("giant with mass,door")
    text = loaded.text.replace(old, new)
    assert text != loaded.text
    with pytest.raises(ConfigError, match=re.escape(told)):
        build(replace(loaded, text=text, config=config.parse(text, loaded.source)))


def test_more_twins_than_a_command_can_name_are_refused() -> None:
    section = config.load("giant").config.giant.twin  # type: ignore[attr-defined]
    others = {f"mass_{k}": section for k in range(MOST_TWINS)}
    assert not check_twins("giant", section, dict(list(others.items())[1:]), 1e-3)
    assert check_twins("giant", section, others, 1e-3)[0][:2] == ("giant.twins", "with the first they are 8")


WRONG = [
    ('"0 0.3 m"', '"0.3 0 m"', "twin.joints.drawer.range: 0.3 is not below 0"),
    ('"0 0.3 m"', '"inf 0.3 m"', "twin.joints.drawer.range: inf is not below 0.3"),
    ('start = "0 m"', 'start = "-1 m"', "twin.joints.drawer.start: -1 is outside 0 to 0.3"),
    ('key = "knob"', 'key = "nob"', "twin.joints.drawer.lock.key: no other joint 'nob'; known: knob"),
    ('key = "knob"', 'key = "drawer"', "no other joint 'drawer'"),
    ('range = "0 0.3 m"\n', "", "twin.joints.drawer.range: is missing"),
    ('inertia = "0.06 kg m^2"', "", "give every joint an inertia"),
    ('"20 N s/m"', '"2e4 N s/m"', "twin.joints.drawer: with its spring and its inertia"),
    ("0.15 rad", "0.15 m", 'twin.joints.knob.detents[0].width: "m" is not a unit of angle'),
    ("[touches]", "[touchs]", 'touchs: is no part of a twin; did you mean "touches"?'),
    ("twin drawer", "twin draw", "the machine has no limit 'twin draw'"),
    ("drawer = ", "draw = ", "hand.path[1]: no joint 'draw'; known: drawer, knob"),
    ('"0.8 rad" }, { at = "10 s"', '"0.8 m" }, { at = "10 s"', "hand.path[3].knob"),
    ('knob = "0.8 rad" }, {', 'knob = "inf rad" }, {', "hand.path[3].knob"),
    ('at = "11 s"', 'at = "1e5 s"', "hand.path: lasts 100000 s; give at most 120 s"),
    ('at = "10 s"', 'at = "6.5 s"', "hand.path: its times do not rise"),
    ('kind = "chain"', 'kind = "chains"', "twin.kind"),
    ("joints.knob]", 'joints."knob\\u001b"]', "1 to 100 characters that print"),
    ('kind = "chain"', 'kind = "chain"\nend = "tip"', "twin.end: names a frame, but there is no URDF"),
    ('kind = "chain"', 'kind = "chain"\nurdf = "panda.urdf"\nend = "handle"', "its joints are joint_1"),
    ('kind = "chain"', 'kind = "chain"\nurdf = "../panda.urdf"\nend = "handle"', "leaves the folder"),
    ('kind = "chain"', 'kind = "chain"\nurdf = "pandas.urdf"\nend = "handle"', 'no model "pandas.urdf"'),
]


@pytest.mark.parametrize(("old", "new", "told"), WRONG)
def test_what_is_wrong_with_a_twin_is_said(tmp_path: Path, old: str, new: str, told: str) -> None:
    assert old in DRAWER
    with pytest.raises(ConfigError) as error:
        build(config.load(written(tmp_path, DRAWER.replace(old, new, 1))))
    assert told in str(error.value)


def test_a_handle_that_no_joint_moves_is_no_end(tmp_path: Path) -> None:
    text = read_text("twins/panda.toml")
    assert 'end = "handle"' in text
    with pytest.raises(ConfigError, match=r"twin\.end: stands: no joint moves it; name a frame behind"):
        build(config.load(written(tmp_path, text.replace('end = "handle"', 'end = "universe"'))))


def test_a_model_that_no_recording_could_keep_is_refused_with_its_line(tmp_path: Path) -> None:
    text = read_text("twins/panda.toml").replace('"panda.urdf"', '"own.urdf"')
    name, line = written(tmp_path, text), text[: text.index("urdf = ")].count("\n") + 1
    good = read_text("panda.urdf")
    for model, told in (
        (good + "<!-- ''' -->", "own.urdf\" contains '''"),
        (good + f"<!-- {'x' * 1000} -->", 'own.urdf" cannot be kept: a line of 1009 characters'),
    ):
        (tmp_path / "own.urdf").write_text(model)
        with pytest.raises(ConfigError) as error:
            config.load(name)
        (found,) = error.value.findings
        assert told in found.problem and (found.key, found.line) == ("twin.urdf", line)


@pytest.mark.parametrize(("stiffness", "damping", "said"), [(20e3, 20, 0), (300e3, 20, 1), (300e3, 2e3, 0)])
def test_a_spring_that_swings_faster_than_a_machine_follows_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], stiffness: float, damping: float, said: int
) -> None:
    """Undamped, a twin on such a spring shook the hand that held it still, more and more."""
    text = DRAWER.replace('"20 N s/m"', f'"{damping:g} N s/m"\nstiffness = "{stiffness:g} N/m"')
    assert main(["check", "giant", "--twin", written(tmp_path, text).removeprefix("giant with ")]) == 0
    assert capsys.readouterr().out.count("joint drawer of the twin swings on its spring with") == said


def test_a_mistake_has_the_line_of_the_twins_own_file(tmp_path: Path) -> None:
    text = DRAWER.replace('velocity = "0.5 m/s"', 'velocity = "0.5 m"')
    line = text.splitlines().index('velocity = "0.5 m"') + 1
    with pytest.raises(ConfigError) as error:
        config.load(written(tmp_path, text))
    assert str(error.value).startswith(f"{tmp_path / 'my_twin.toml'}:{line}: twin.joints.drawer.velocity")


def test_a_twin_that_is_not_there_and_a_machine_that_renders_none() -> None:
    with pytest.raises(ConfigError, match='did you mean "door"'):
        config.load("giant with doors")
    with pytest.raises(ConfigError, match="a machine of the kind rhi renders no twin"):
        config.load("rhi with door")
