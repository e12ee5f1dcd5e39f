"""An arm's configuration agrees with its model, its rate and its plant, or is refused."""

from __future__ import annotations

import pytest
from hapticd.configs import read_text
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.errors import ConfigError

GOOD, MODEL = read_text("panda.toml"), read_text("panda.urdf")


def findings(*changes: tuple[str, str], model: str = MODEL) -> dict[str, str]:
    """Key and problem of everything that is wrong with a changed configuration."""
    text = GOOD
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    try:
        loaded = config.Loaded("panda", config.parse(text, "p.toml"), text, "p.toml", model, "panda.urdf")
        build(loaded)
    except ConfigError as error:
        return {found.key: found.problem for found in error.findings}
    return {}


def test_the_built_in_one_is_fine() -> None:
    assert findings() == {}


SLIDES = """type = "prismatic"
range = "-1 1 m"
velocity = "1 m/s"
acceleration = "9 m/s^2"
rotor_inertia = "1 kg"
stiffness = "9 N/m"
p_gain = "9 N/m"
d_gain = "9 N s/m"
home = "0 m"
"""
JOINT_1 = GOOD.partition("[arm.joints.joint_1]\n")[2].partition("\n[arm")[0]


@pytest.mark.parametrize(
    ("changes", "key", "problem"),
    [
        ([("[arm.joints.joint_1]", "[arm.joints.joint_9]")], "arm.joints", "has joint_9, joint_2"),
        ([(JOINT_1, SLIDES)], "arm.joints.joint_1.type", "is another"),
        ([('stiffness = "12000 N m/rad"', "#")], "arm.joints.joint_1.stiffness", "others have one"),
        ([('range = "-2.85 2.85 rad"', 'range = "-2.95 2.85 rad"')], "arm.joints.joint_1.range", "outside"),
        ([('range = "-2.85 2.85 rad"', 'range = "2.85 -2.85 rad"')], "arm.joints.joint_1.range", "not below"),
        (
            [('range = "-1.72', 'gear_friction = "80 N m"\nbearing_friction = "7 N m"\nrange = "-1.72')],
            "arm.joints.joint_2.gear_friction",
            "87 N m are as much as its motor gives",
        ),
        ([('velocity = "2 rad/s"', 'velocity = "3 rad/s"')], "arm.joints.joint_1.velocity", "3 of joint_1"),
        ([('acceleration = "7.5 rad/s^2"', 'acceleration = "4 rad/s^2"')], "safety.stop_time", "takes 0.5 s"),
        ([('handle = "handle"', 'handle = "hand"')], "arm.frames.handle", "lacks the frame 'hand'"),
        ([('sensor = "force_torque"', 'sensor = "link_3"')], "arm.frames.sensor", "carried by another"),
        ([('frame = "link_4"', 'frame = "base"')], "arm.boxes[1].frame", "never moves"),
        ([('"x", "y", "z", "rx"', '"y", "x", "z", "rx"')], "arm.directions", "reorders"),
        ([('detection = "gauss"', 'detection = "redetect"')], "arm.force_control.detection", "six joints"),
        ([('d_gain = "20 1/s"', 'd_gain = "1200 1/s"')], "arm.force_control.d_gain", "one period"),
        ([('d_gain = "72 N m s/rad"', 'd_gain = "720 N m s/rad"')], "arm.joints.joint_1.d_gain", "one"),
        ([('damping = "6 N s/m"', 'damping = "6000 N s/m"')], "arm.twin.damping", "one period"),
        ([("joint_4 = -1.0", "joint_9 = -1.0")], "arm.sums[0].weights", "no joint 'joint_9'"),
        ([("joint_2 = 1.0, joint_4 = -1.0", "joint_2 = 0.0")], "arm.sums[0].weights", "all 0"),
        ([("upper = \"0.6 0.3 0.7 m\"", "upper = \"0.2 0.3 0.7 m\"")], "arm.boxes[0].lower", "not below"),
        ([('[arm.posture]', '[arm.posture]#'), ('home = "0 rad"', "#")],
         "arm.joints.joint_1.home", "is missing"),
        ([('mass = "0.5 kg"', 'mass = "0.9 kg"')], "arm.handle.mass", "has 0.5 kg"),
        ([("[devices.joint_7]", "[devices.joint_8]")], "devices.joint_8", "no such device"),
        ([('rated_torque = "87 N m"', 'rated_torque = "1 N m"')], "devices.joint_1.rated_torque", "carries"),
        ([('start = "-2.356 rad"', 'start = "-3.1 rad"')], "simulation.arm.joints.joint_4.start", "outside"),
        ([('upper = "0.6 0.3 0.7 m"', 'upper = "0.6 0.3 0.4 m"')], "simulation.arm.joints", "handle z"),
        ([('brake = "100 N m"\nspring', 'brake = "1 N m"\nspring')] * 2,
         "simulation.arm.joints.joint_2.brake", "do not hold"),
        ([('spring_damping = "15 N m s/rad"', "#")],
         "simulation.arm.joints.joint_1.spring_damping", "missing"),
        ([("substeps = 3", "substeps = 1"), ('"5 N m s/rad"', '"50 N m s/rad"')],
         "simulation.arm.substeps", "too few"),
        ([("0.0006 0.0006 0.0002", "0.0006 0.0002 0.0002")], "simulation.arm.handle_inertia", "rigid body"),
        ([('torque = "3 N m"', "#")], "simulation.hand", "by halves"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_named(changes: list[tuple[str, str]], key: str, problem: str) -> None:
    found = findings(*changes)
    assert problem in found.get(key, ""), found


def test_an_arm_with_spare_joints_needs_a_posture() -> None:
    posture = GOOD.partition("[arm.posture]")[2].partition("\n[[arm.sums]]")[0]
    found = findings((f"[arm.posture]{posture}", ""))
    assert "leaves 1 of the joints free" in found["arm.posture"]


def test_a_model_with_too_many_joints_is_refused() -> None:
    model = MODEL.replace('name="grip" type="fixed"', 'name="grip" type="revolute"').replace(
        '<child link="handle" />',
        '<child link="handle" /><axis xyz="0 0 1" /><limit lower="-1" upper="1" effort="1" velocity="1" />'
        '<dynamics damping="0" />',
        1,
    )
    assert "has 8 moving joints" in findings(model=model)["model"]
