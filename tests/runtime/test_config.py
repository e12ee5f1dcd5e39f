"""Bad configurations are refused with file, line, reason and fix, before anything moves."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.configs.units import RANGES
from hapticd.models import ModelError
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.configuration.toml_reader import MAX_BYTES, MAX_DEPTH, MAX_LINE
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.errors import ConfigError

from .conftest import Bench, changed, loaded

LIMITS = 'upper = "inf 2.4 1.2 1.15 2.2 1.2 rad"'


def line_with(text: str, needle: str) -> int:
    return next(k for k, line in enumerate(text.splitlines(), 1) if needle in line)


def finding(*changes: tuple[str, str]):  # type: ignore[no-untyped-def]
    with pytest.raises(ConfigError) as error:
        build(loaded(*changes))
    assert error.value.exit_status == 2
    found = error.value.findings[0]
    assert f"giant.toml:{found.line}: " in str(error.value)
    return found


def test_the_built_in_giant_is_right() -> None:
    session = build(config.load("giant"))
    assert session.config.giant.manipulator.upper[3] == 1.15
    assert session.config.devices["joint_1"].node == 1


def test_zeros_of_drives_have_either_sign_and_move_no_joint() -> None:
    """A plant whose encoders begin elsewhere stands where it stood, to half a count."""
    zeros = (
        ("node = 1\n", 'node = 1\nzero = "-0.3 rad"\nlink_zero = "-170 deg"\nsign = -1\n'),
        ("node = 7\n", 'node = 7\nzero = "-412 mm"\n'),
    )
    own, other = Bench(), Bench(*zeros)
    assert other.lockstep.session.config.devices["joint_1"].zero == -0.3
    for bench in (own, other):
        bench.until(Mode.READY, limit=5000)
    for name in ("joints.position", "joints.link_position", "axes.position"):
        np.testing.assert_allclose(other.cycle.image[name], own.cycle.image[name], rtol=0.0, atol=1e-5)


@pytest.mark.parametrize(
    ("old", "new", "problem", "fix"),
    [
        ('rate = "1 kHz"', 'rat = "1 kHz"', "unknown key", 'did you mean "rate"?'),
        ('rate = "1 kHz"', "rate = 1000", "has no unit", "Hz"),
        ('rate = "1 kHz"', 'rate = "1 khz"', "not a unit of frequency", "kHz"),
        ('rate = "1 kHz"', 'rate = "nan kHz"', "NaN", ""),
        ('rate = "1 kHz"', "rate = nan", "has no unit", ""),
        ('rate = "1 kHz"', 'rate = "0 kHz"', "out of range", "> 0"),
        ('rate = "1 kHz"', 'rate = "100 Hz"', "100 Hz", "200 to 8000 Hz"),
        ('rate = "1 kHz"', 'rate = "9 kHz"', "9000 Hz", "200 to 8000 Hz"),
        ('rate = "1 kHz"', 'rate = "1 kHz"\nspin = "600 us"', "more than half a period", "60 us"),
        ('rate = "1 kHz"', 'rate = "1 kHz"\nspin = "-1 us"', "out of range", ">= 0"),
        ('rate = "1 kHz"', 'rate = "1 kHz"\ncpu = -1', ">= 0", ""),
        ('rate = "1 kHz"', 'rate = "1 kHz"\nsync = "buss"', "Invalid enum value 'buss'", "known: free, bus"),
        ('position_margin = "30 mrad"', 'position_margin = "30 rad"', "out of range", "at most 0.2 rad"),
        ('position_margin = "30 mrad"', 'position_margin = "0 rad"', "is not a margin", "more than 0"),
        ('ppu_margin = "60 mm"', 'ppu_margin = "6 m"', "out of range", "at most 0.2 m"),
        ('stop_time = "500 ms"', 'stop_time = "150 s"', "150 s", "at most 1 s"),
        ('mass = "', 'mass = "1e-12 kg" #', "out of range", "at least"),
        ('force = "660 N"', 'force = "1e9 N"', "out of range", "at most 5000 N"),
        ("link_counts_per_turn = 1048576", "link_counts_per_turn = 99999999999", "<= 1073741823", ""),
        ('at = "4.45 s"', 'at = "3.2 s"', "times do not rise", "order"),
        (
            'dead_man = [{ at = "0.3 s", pressed = true }]',
            'dead_man = [{ at = "2 s", pressed = true }, { at = "1 s", pressed = false }]',
            "times do not rise",
            "order",
        ),
        ('fade = "3 s"', 'fade = "1 s"', "too sudden", "3 s"),
        ("node = 3", "node = 300", "<= 127", ""),
        ('ppu_margin = "60 mm"', 'ppu_margin = "0 mm"', "out of range", "> 0"),
        ("node = 3", "node = 2", "node 2 is taken", ""),
        ('rated_torque = "110 N m"', 'rated_torque = "110 N"', "not a unit of torque", "N m"),
        (
            'rated_torque = "110 N m"',
            'rated_torqe = "110 N m"',
            "unknown key",
            'did you mean "rated_torque"?',
        ),
        (
            'type = "imu"',
            'type = "imuu"',
            "no kind of device 'imuu' is installed",
            'did you mean "imu"?',
        ),
        ("gear_ratio = [", "gear_ratio = [-0, 1] # [", "Expected `int` >= 1", "teeth of a gear"),
        ('kind = "simulated"', 'kind = "simulate"', "Invalid value 'simulate'", "socketcan, python-can"),
        (
            'kind = "simulated"',
            'kind = "python-can"\ninterface = "pcan"\nchanel = "1"',
            "unknown key",
            'did you mean "channel"?',
        ),
        (
            'kind = "simulated"',
            'kind = "simulated"\nrate = 1',
            "unknown key",
            "known here: kind",
        ),
        ('at = "0.3 s"', 'when = "0.3 s"', "unknown key", "known here: at, pressed"),
        (
            'velocity = "2.5 2.5 3 3 4 5 rad/s"',
            'velocity = "2.5 2.5 3 3 4 rad/s"',
            "holds 5 numbers",
            "give 6",
        ),
        (
            'velocity = "2.5 2.5 3 3 4 5 rad/s"',
            'velocity = "2.5 2.5 3 3 4 9 rad/s"',
            "outside the model's 5",
            "inside",
        ),
        (
            LIMITS,
            'upper = "inf 2.5 1.2 1.15 2.2 1.2 rad"',
            "2.5 of joint_2 is outside the model's 2.4",
            "inside",
        ),
        (LIMITS, 'upper = "inf 0.4 1.2 1.15 2.2 1.2 rad"', "is not below", ""),
        ('tilt = "0.6 2.5415926535897931 rad"', 'tilt = "0 2.5 rad"', "leaves (0, pi)", ""),
        ('lower = "-2.2 -2.6 -1.28 m"', 'lower = "-2.2 -2.6 -0.74 m"', "elbow's constant height", ""),
        ('stop_time = "500 ms"', 'stop_time = "450 ms"', "braking alone takes 0.4 s", "longer"),
        ("[devices.imu_carriage]", "[devices.imu_carrage]", "no such device", 'did you mean "imu_carriage"?'),
        ('kind = "cartesian"', 'kind = "excavator"', "Invalid value 'excavator'", "known: cartesian, chain"),
        ('kind = "cartesian"', "", "is missing", "add it"),
        ('mass = "4 kg"', "", "is missing", "add it"),
        ("[giant.twin]", "[giant.twn]", "unknown key", 'did you mean "twin"?'),
        ('angles = "0 60 0 deg"', 'angels = "0 60 0 deg"', "unknown key", 'did you mean "angles"?'),
        ("seed = 1", "seed = 1\nseed = 2", "not TOML", ""),
        ('model = "giant.urdf"', "model = 3", "Expected `str`", "write words in quotes"),
        ('detection = "gauss"', 'detection = "gauss"\npassivity = 1', "Expected `bool`", "true or false"),
        ("[giant.twin]", "[giant.twins.Big]\n[giant.twin]", "'Big' cannot be a name", "a to z"),
        (
            'system = "giant"',
            'system = "dwarf"',
            "no kind of machine 'dwarf' is installed",
            "known: arm, avatar, giant, operator, rhi",
        ),
    ],
)
def test_a_mistake_is_named_with_its_line_and_a_fix(old: str, new: str, problem: str, fix: str) -> None:
    found = finding((old, new))
    assert problem in found.problem
    assert fix in found.fix
    if new and "\n" not in new and "node = 2" not in new:
        text = changed((old, new))
        # the line itself, or that of the section around it
        assert abs(found.line - line_with(text, new)) <= 12


ABOVE_0 = "give a finite number > 0"


@pytest.mark.parametrize(
    ("machine", "old", "new", "key", "fix"),
    [
        ("panda", "joint_2 = 1.0", "joint_2 = 1e4", "arm.sums[0].weights.joint_2", "gears have ratios"),
        ("panda", "joint_4 = -1.0", "joint_4 = nan", "arm.sums[0].weights.joint_4", "gears have ratios"),
        ("panda", '"inf inf inf m"', '"inf inf m"', "arm.boxes[1].upper", "give 3"),
        ("panda", 'frame = "link_4"', 'fram = "link_4"', "arm.boxes[1].fram", 'did you mean "frame"?'),
        ("panda", '"revolute"\nweights', '"hinge"\nweights', "arm.sums[0].type", "revolute, prismatic"),
        ("panda", 'd_gain = "72 ', 'd_gain = "0 ', "arm.joints.joint_1.d_gain", ABOVE_0),
        ("rhi", 'margin = "0.15 rad"', 'margin = "0 rad"', "rhi.null_space.margin", ABOVE_0),
        ("avatar", 'normal = "-1', 'normel = "-1', "simulation.walls[0].normel", 'did you mean "normal"?'),
        ("avatar", 'damping = "110 ', 'damping = "0 ', "avatar.impedance.damping", ABOVE_0),
        ("avatar", 'damping = "5.5 ', 'damping = "0 ', "avatar.impedance.rotational_damping", ABOVE_0),
        ("avatar", 'damping = "4 N', 'damping = "0 N', "avatar.posture.damping", ABOVE_0),
        ("avatar", 'damping = "30 N s/m"', 'damping = "0 N s/m"', "simulation.hand.damping", ABOVE_0),
        ("panda", 'damping = "0.8 N', 'damping = "0 N', "simulation.hand.rotational_damping", ABOVE_0),
        ("operator", 'damping = "4 N', 'damping = "0 N', "operator.avatar.posture.damping", ABOVE_0),
    ],
)
def test_a_mistake_in_a_list_or_in_a_controller_is_named(
    machine: str, old: str, new: str, key: str, fix: str
) -> None:
    text = changed((old, new), machine=machine)
    with pytest.raises(ConfigError) as caught:
        config.parse(text, "x.toml")
    (found,) = caught.value.findings
    assert found.key == key
    assert fix in f"{found.problem}; {found.fix}"
    assert key.rpartition(".")[2] in text.splitlines()[found.line - 1]


def test_the_line_is_exact_for_a_plain_mistake() -> None:
    change = ('d_gain = "20 1/s"', 'd_gain = "20 1/ms"')
    assert finding(change).line == line_with(changed(change), "1/ms")


def test_a_real_bus_must_not_arm_by_itself_or_ignore_overruns() -> None:
    real = ('kind = "simulated"', 'kind = "socketcan"\ninterface = "can0"')
    with pytest.raises(ConfigError) as error:
        build(loaded(real))
    assert [f.key for f in error.value.findings] == ["loop.on_overrun", "arming.by"]
    build(
        loaded(real, ('on_overrun = "record"', 'on_overrun = "stop"'), ('by = "dead-man"', 'by = "command"'))
    )


def test_names_and_paths_that_lead_nowhere_say_what_there_is(tmp_path: Path) -> None:
    for name in ("gaint", "Giant"):
        machines = "avatar, giant, giant_avatar, giant_operator, operator, panda, panda_rhi, panda_stamp, rhi"
        there = f"built in: {machines}"
        with pytest.raises(ConfigError, match=rf'did you mean "giant"\? {there}'):
            config.load(name)
    with pytest.raises(ConfigError, match="cannot be read"):
        config.load(str(tmp_path / "none.toml"))
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="not UTF-8"):
        config.load(str(tmp_path / "binary.toml"))
    (tmp_path / "huge.toml").write_text("#" * (2 << 20))
    with pytest.raises(ConfigError, match="larger than"):
        config.load(str(tmp_path / "huge.toml"))


def test_a_file_that_is_no_text_or_no_file_is_refused_with_a_reason(tmp_path: Path) -> None:
    (tmp_path / "latin.toml").write_bytes('# größer\nx = "ß"\n'.encode("latin-1"))
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    for name, why in (
        ("latin", "latin.toml:1: is not UTF-8"),
        ("pipe", "not a regular"),
        ("folder", "not a regular"),
    ):
        with pytest.raises(ConfigError, match=why):
            config.load(str(tmp_path / f"{name}.toml"))
    for name in ("x" * 5000, "x\0y", "x" * 300 + ".toml", "x\0y.toml"):
        with pytest.raises(ConfigError):
            config.load(name)


def test_a_model_that_is_no_text_is_refused(write_config: Callable[..., Path], tmp_path: Path) -> None:
    path = write_config()
    for content, why in (
        (b"\xff\xfe" + read_text("giant.urdf").encode(), "giant.urdf:1: is not UTF-8"),
        (b" " * (5 << 20), "larger than"),
    ):
        (tmp_path / "giant.urdf").write_bytes(content)
        with pytest.raises(ConfigError, match=why):
            config.load(str(path))
    for model in ("", "x" * 101, "x" * 99, "a\\u0000b", "."):
        with pytest.raises(ConfigError):
            config.load(str(write_config(('model = "giant.urdf"', f'model = "{model}"'))))


def test_a_message_holds_nothing_that_a_terminal_obeys() -> None:
    for change in (('system = "giant"', 'system = "\\u001b[2J"'), ("seed = 1", '"\\u001b[2J" = 1')):
        with pytest.raises(ConfigError) as error:
            loaded(change)
        assert all(line.isprintable() for line in str(error.value).splitlines())


def test_the_manual_lists_the_ranges() -> None:
    manual = (Path(__file__).parents[2] / "docs" / "files.md").read_text()
    for name, allowed in RANGES.items():
        assert f"| {name} | {allowed} | {allowed.why} |" in manual
    for bound in (f"{MAX_BYTES >> 10} KiB", f"{MAX_LINE} characters", f"{MAX_DEPTH} levels"):
        assert bound in manual


def test_the_model_must_lie_beside_the_configuration(
    write_config: Callable[..., Path], tmp_path: Path
) -> None:
    assert config.load(str(write_config())).model_text == read_text("giant.urdf")
    with pytest.raises(ConfigError, match="leaves the folder"):
        config.load(str(write_config(('model = "giant.urdf"', 'model = "../giant.urdf"'))))
    with pytest.raises(ConfigError, match=r'no file "other\.urdf"'):
        config.load(str(write_config(('model = "giant.urdf"', 'model = "other.urdf"'))))
    (tmp_path / "parts").mkdir()
    with pytest.raises(ConfigError, match=r'machine\.toml:\d+: model: "parts" is a folder; name the URDF'):
        config.load(str(write_config(('model = "giant.urdf"', 'model = "parts"'))))


def test_a_dangerous_model_is_refused(write_config: Callable[..., Path]) -> None:
    bad = read_text("giant.urdf").replace('lower="0.45" upper="2.4"', 'lower="2.4" upper="0.45"')
    with pytest.raises(ModelError, match="not below upper"):
        build(config.load(str(write_config(model=bad))))
