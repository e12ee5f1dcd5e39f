"""A redundant interface's configuration agrees with its model, its rate and its plant, or is refused."""

import re
from random import Random

import pytest
from hapticd.configs import read_text
from hapticd.machines.rhi.body_check import check_bodies
from hapticd.machines.rhi.config import RhiConfig
from hapticd.machines.rhi.stance import rhi_stance
from hapticd.models import Robot
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.errors import ConfigError

from ...runtime.conftest import changed

FRICTION = 'friction = "0.063 0.112 0.040 0.027 N m s/rad"\nbrake'
"""Friction of the plant."""


@pytest.fixture(scope="module")
def panda() -> str:
    """The model of an arm that carries weight."""
    return read_text("panda.urdf")


IN_SPACE = ('point = "0.5 0.1 m"', 'point = "0.5 0.1 0 m"'), ("normal = [0, 1]", "normal = [0, 1, 0]")


def findings(*changes: tuple[str, str], model: str | None = None, machine: str = "rhi") -> dict[str, str]:
    """Key and problem of everything that is wrong with a changed configuration or model."""
    text, urdf = changed(*changes, machine=machine), model or read_text("rhi.urdf")
    loaded = config.Loaded(machine, config.parse(text, "rhi.toml"), text, "rhi.toml", urdf, "rhi.urdf")
    try:
        build(loaded)
    except ConfigError as error:
        return {found.key: found.problem for found in error.findings}
    return {}


def turned(*changes: tuple[str, str]) -> str:
    """The model with some texts replaced, each of which must occur."""
    text = read_text("rhi.urdf")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(
    ("changes", "key", "problem"),
    [
        ([('torque = "3 3 1 1 N m"', 'torque = "3 3 1.6 1 N m"')], "rhi.motors.torque", "joint_3 to 2.6"),
        ([('torque = "3 3 1 1 N m"', 'torque = "3.2 3 1 1 N m"')], "rhi.motors.torque", "joint_1 to 6.2"),
        (
            [
                ('velocity = "15 15 15 15', 'velocity = "15 16 15 15'),
                ('acceleration = "150 150', 'acceleration = "150 200'),
            ],
            "rhi.motors.velocity",
            "joint_2 to 31, the model's limit is 30",
        ),
        ([("[[1, 0, 0, 0]", "[[3, 0, 0, 0]")], "rhi.motors.velocity", "joint_1 to 45"),
        ([('home = "0 0 0 0 rad"', 'home = "2.1 0 0 0 rad"')], "rhi.task.home", "outside the motors' limits"),
        ([('posture = "1.02', 'posture = "2.02')], "simulation.rhi.posture", "outside the motors' limits"),
        ([('damping = "0.8 0.8 0.3 0.3', 'damping = "0.8 0.8 9 0.3')], "rhi.hold", "one period"),
        ([('damping = "0.1 N m s/rad"', 'damping = "9 N m s/rad"')], "rhi.null_space", "one period"),
        ([('release = "50 ms"', 'release = "0.5 ms"')], "rhi.saturation.release", "one period"),
        ([('# follow = "0.5 s"', 'follow = "0.5 ms"')], "rhi.task.follow", "one period"),
        (
            [(FRICTION, FRICTION.replace("0.040", "90"))],
            "simulation.rhi.substeps",
            "too few",
        ),
        ([("[[1, 0, 0, 0]", "[[0.0001, 0, 0, 0]")], "rhi.motors.transmission", "singular"),
        ([('torque = "3 3 1 1 N m"', 'torque = "1 3 1 1 N m"')], "rhi.motors.velocity", "need 0.21 s"),
        ([('cap = "2 N m"', 'cap = "4.5 N m"')], "rhi.null_space.cap", "motor 3 has 1 N m to brake with"),
        (
            [('["x", "y"]', '["x", "y", "z", "rx", "ry", "rz"]'), *IN_SPACE],
            "rhi.task.directions",
            "names 6, and 4 joints move the hand in 4 at most",
        ),
        ([('["x", "y"]', '["x", "y", "z"]'), *IN_SPACE], "rhi.task.home", "is a singular posture"),
        ([("normal = [0, 1]", "normal = [0, 1e-5]")], "rhi.bodies.wall.normal", "no length"),
        (
            [("counts_per_turn = 65536", "counts_per_turn = 64")],
            "devices.motor_1.counts_per_turn",
            "640 counts",
        ),
        (
            [("gear_ratio = [10, 1]", "gear_ratio = [50000, 1]")],
            "devices.motor_1.counts_per_turn",
            "leave 32 bits",
        ),
        ([("at = \"4.4 s\"", "at = \"3.201 s\"")], "simulation.hand.path[2]", "m in 0.001 s"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_named(changes: list[tuple[str, str]], key: str, problem: str) -> None:
    found = findings(*changes)
    assert problem in found[key]


def test_limits_of_the_model_bind_the_motors_through_the_transmission() -> None:
    weak = turned(('effort="6" velocity="30"', 'effort="0.5" velocity="2"'))
    assert set(findings(model=weak)) == {"rhi.motors.torque", "rhi.motors.velocity"}
    narrow = re.sub(
        r'(<joint name="joint_2" type=")continuous(".*?<limit)',
        r'\1revolute\2 lower="-3" upper="3"',
        read_text("rhi.urdf"),
        count=1,
        flags=re.S,
    )
    found = findings(model=narrow)  # q2 - q1 reaches from -2.8 to 3.6 rad
    assert found == {"rhi.motors.upper": "takes joint_2 to 3.6, the model's limit is 3"}


@pytest.mark.parametrize("pose", ["0 0.3 0", "1.5707963267948966 0 0"])
def test_an_arm_that_its_motors_can_carry_may_stand_in_any_pose(pose: str) -> None:
    model = turned(('xyz="0.0 0 0" rpy="0 0 0.0"', f'xyz="0.0 0 0" rpy="{pose}"'))
    assert not {"model", "rhi.motors.torque"} & findings(("scan = 4000", "scan = 0"), model=model).keys()


def test_a_motor_whose_torque_the_arm_s_weight_takes_is_named_and_what_it_needs(panda: str) -> None:
    found = findings(
        ('torque = "87 87 87 87 12 12 12', 'torque = "87 60 87 87 12 12 12'), ("scan = 2000", "scan = 0"),
        model=panda, machine="panda_rhi",
    )  # fmt: skip
    assert re.search(
        r"^60 N m of motor 2: at .* rad the arm's weight takes [456]\d", found["rhi.motors.torque"]
    )
    assert not findings(("scan = 2000", "scan = 0"), model=panda, machine="panda_rhi")


def test_the_friction_of_a_motor_is_at_least_its_joint_s(panda: str) -> None:
    less = ('"0.6 0.6 0.6 0.6 0.3 0.3 0.3 N m s/rad"', '"0.6 0.4 0.6 0.6 0.3 0.3 0.3 N m s/rad"')
    found = findings(less, model=panda, machine="panda_rhi")
    assert "0.4 of motor 2, and the model damps its joint with 0.5" in found["rhi.motors.friction"]


def test_masses_are_one_factor_or_one_a_joint(panda: str) -> None:
    found = findings(("masses = 1.02", "masses = [1, 1.1]"), model=panda, machine="panda_rhi")
    assert found["simulation.rhi.masses"] == "holds 2 entries"


def test_a_plant_upside_down_needs_no_gravity() -> None:
    model = turned(('xyz="0.0 0 0" rpy="0 0 0.0"', 'xyz="0.0 0 0" rpy="3.141592653589793 0 0"'))
    assert "model" not in findings(("scan = 4000", "scan = 0"), model=model)


def test_damping_that_nobody_computes_is_refused() -> None:
    assert "damps joints" in findings(model=turned(('damping="0"', 'damping="0.1"')))["model"]


def test_a_simulated_bus_needs_a_simulation() -> None:
    text = read_text("rhi.toml").partition("[simulation]")[0]
    loaded = config.Loaded(
        "rhi", config.parse(text, "m.toml"), text, "m.toml", read_text("rhi.urdf"), "m.urdf"
    )
    with pytest.raises(ConfigError, match="simulation: is missing"):
        build(loaded)


def test_the_built_in_interface_is_right() -> None:
    assert findings() == {}


def test_no_random_wall_is_refused_for_a_normal_without_length() -> None:
    """The first direction that this seed draws is 0.95e-3 long."""
    built_in = config.load("rhi")
    robot = Robot.from_urdf(built_in.model_text, built_in.model_source)
    assert isinstance(built_in.config, RhiConfig)
    varied = rhi_stance(built_in.config, robot, Random(82070)).config
    assert not check_bodies(varied.rhi.bodies)
