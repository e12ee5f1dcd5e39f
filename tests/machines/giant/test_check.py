"""A giant's configuration agrees with its model, its rate and its plant, or is refused."""

import re

import pytest
from hapticd.configs import read_text
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.errors import ConfigError

from ...runtime.conftest import changed

GOOD = read_text("giant.urdf")


def findings(*changes: tuple[str, str], model: str = GOOD) -> dict[str, str]:
    """Key and problem of everything that is wrong with a changed configuration or model."""
    text = changed(*changes)
    loaded = config.Loaded("giant", config.parse(text, "giant.toml"), text, "giant.toml", model, "giant.urdf")
    try:
        build(loaded)
    except ConfigError as error:
        return {found.key: found.problem for found in error.findings}
    return {}


@pytest.mark.parametrize(
    ("changes", "key", "problem"),
    [
        (
            [('posture = "-0.9026 1.5724', 'posture = "-0.9026 2.5')],
            "simulation.giant.posture",
            "2.5 of joint_2",
        ),
        ([('ppu = "0.195 -0.8 m"', 'ppu = "0.195 -2 m"')], "simulation.giant.ppu", "-2 of ppu_y"),
        (
            [("130 130 50 50 N m", "130 20 50 50 N m")],
            "simulation.giant.brake_torque",
            "do not hold its 22.6",
        ),
        ([("0.0009 0.0009 0.0003", "0.0009 0.0003 0.0003")], "simulation.giant.handle_inertia", "rigid body"),
        ([("substeps = 3", "substeps = 1")], "simulation.giant.substeps", "too few"),
        ([('d_gain = "180', 'd_gain = "1800')], "giant.tracking.d_gain[0]", "one period"),
        ([('d_gain = "20 1/s"', 'd_gain = "1000 1/s"')], "giant.force_control.d_gain", "one period"),
        ([('damping = "8 N s/m"', 'damping = "8000 N s/m"')], "giant.twin.damping", "one period"),
        (
            [('rotational_damping = "0.25', 'rotational_damping = "250')],
            "giant.twin.rotational_damping",
            "one",
        ),
        (
            [('gear_friction = "5.2 5.2 2.2 2.2 0.87', 'gear_friction = "5.2 5.2 2.2 2.2 40')],
            "giant.tracking.gear_friction",
            "40.12 N m are as much as its motor gives",
        ),
        ([('gain = "3 1/s"', 'gain = "1000 1/s"')], "giant.ppu.gain", "one period"),
        ([('time_constant = "50 ms"', 'time_constant = "0.5 ms"')], "giant.ppu.time_constant", "one period"),
        (
            [('point_horizon = "15', 'point_horizon = "0.15')],
            "giant.force_control.point_horizon",
            "one period",
        ),
    ],
)
def test_what_does_not_fit_is_named(changes: list[tuple[str, str]], key: str, problem: str) -> None:
    assert problem in findings(*changes)[key]


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('<origin xyz="0.53 0.0 0.0"', '<origin xyz="0.56 0.0 0.0"', "0.0287 m away"),
        ('name="imu_handle_mount"', 'name="x" type="fixed"><!--', "lacks the frame 'imu_handle'"),
        ('<joint name="joint_6"', '<joint name="wrist"', "lacks joint_6"),
        ('<parent link="carriage" />\n    <child link="imu_carriage" />',
         '<parent link="bridge" />\n    <child link="imu_carriage" />', "carried by another joint"),
        ('<parent link="handle" />\n    <child link="imu_handle" />',
         '<parent link="link_5" />\n    <child link="imu_handle" />', "carried by another joint"),
    ],
)  # fmt: skip
def test_another_machine_is_no_giant(old: str, new: str, problem: str) -> None:
    model = GOOD
    if "<!--" in new:
        model = re.sub(r'<joint name="imu_handle_mount".*?</joint>', "", GOOD, flags=re.S)
        model = model.replace('<link name="imu_handle" />', "")
    else:
        assert old in model
        model = model.replace(old, new, 1)
    assert problem in findings(model=model)["model"]


def test_the_handle_weighs_what_the_model_says() -> None:
    bare = re.sub(r'(<link name="handle">\s*)<inertial>.*?</inertial>', r"\1", GOOD, flags=re.S)
    assert "has 0 kg" in findings(model=bare)["giant.handle.mass"]
    assert "has 0.9 kg" in findings(('mass = "0.9 kg"', 'mass = "9 kg"'))["giant.handle.mass"]
    assert findings(('mass = "0.9 kg"', 'mass = "0.8 kg"')) == {}  # as calibrated
    found = findings(('centre = "0 0 0.0368 m"', 'centre = "0 0 0.368 m"'))
    assert "0.0368) m" in found["giant.handle.centre"]


def test_masses_that_the_motors_cannot_hold_are_refused() -> None:
    model = re.sub(r'(<link name="link_4">.*?<mass value=")[^"]*', r"\g<1>300", GOOD, count=1, flags=re.S)
    model = re.sub(
        r'(<link name="link_4">.*?<inertia )[^>]*',
        r'\1ixx="9" ixy="0" ixz="0" iyy="9" iyz="0" izz="9" /',
        model,
        count=1,
        flags=re.S,
    )
    found = findings(model=model)
    assert "does not hold" in found["model"] and "do not hold" in found["simulation.giant.brake_torque"]
