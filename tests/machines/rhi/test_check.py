"""A redundant interface's configuration agrees with its model, its rate and its plant, or is refused."""

import re
from random import Random
from typing import Any

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.machines.rhi import check
from hapticd.machines.rhi.body_check import check_bodies
from hapticd.machines.rhi.config import RhiConfig
from hapticd.machines.rhi.stance import rhi_stance
from hapticd.models import Robot
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.configuration.session import remarks as told
from hapticd.runtime.errors import ConfigError
from hapticd.testing.bench import Bench

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
        ([('home = "0 0 0 0 rad"', 'home = "2.1 0 0 0 rad"')], "rhi.task.home", "outside the limits of"),
        ([('posture = "1.02', 'posture = "2.02')], "simulation.rhi.posture", "outside the limits of"),
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


SAYS = "what it renders; docs/rhi.md has spheres, boxes, solids, layers and force fields"
WALL = f"""[rhi.bodies.wall]       # {SAYS}
kind = "plane"
point = "0.5 0.1 m"     # X0
normal = [0, 1]
stiffness = "1000 N/m"
"""
TUMOUR = 'spots = [{ point = "5.5 0.2 m", radius = "15 mm", factor = 3 }]'
BRAKE = """[rhi.bodies.brake]
kind = "resist"
point = "0.5 0 m"
radius = "9 cm"
damping = "90 N s/m"
"""
HELP = """[rhi.bodies.help]
kind = "assist"
point = "0.5 0 m"
force = "90 N"
soft = "1 mm"
"""
BOX = """[rhi.bodies.slab]
kind = "box"
point = "0.5 0.2 m"
size = "0.4 0.2 m"
stiffness = "900 N/m"
"""
SQUARE = """[rhi.bodies.square]
kind = "solid"
vertices = ["0.4 0.1 m", "0.6 0.1 m", "0.6 0.2 m", "0.4 0.2 m"]
stiffness = "900 N/m"
"""


def refusal(body: str, *changes: tuple[str, str]) -> tuple[str, str, str]:
    """Key, problem and text of the line of the only thing that is wrong with other bodies."""
    text = changed((WALL, body), ("scan = 4000", "scan = 200"), *changes, machine="rhi")
    with pytest.raises(ConfigError) as error:
        parsed = config.parse(text, "rhi.toml")
        build(config.Loaded("rhi", parsed, text, "rhi.toml", read_text("rhi.urdf"), "rhi.urdf"))
    (found,) = error.value.findings
    assert found.fix
    return found.key, found.problem, text.splitlines()[found.line - 1]


@pytest.mark.parametrize(
    ("body", "key", "problem"),
    [
        (
            BOX.replace("0.4 0.2 m", "0.4 0.02 m")
            + 'layers = [{ thickness = "30 mm", stiffness = "500 N/m" }]',
            "slab.layers",
            "are 0.03 m deep, and nothing in the body is deeper than 0.00",
        ),
        (
            BOX.replace("box", "sphere").replace('size = "0.4 0.2 m"', 'radius = "0.1 m"')
            + 'layers = [{ thickness = "90 mm", stiffness = "500 N/m" }]',
            "slab.layers",
            "deeper than 0.0875 m",
        ),
        (
            SQUARE + 'layers = [{ thickness = "60 mm", stiffness = "500 N/m" }]',
            "square.layers",
            "deeper than 0.0",
        ),
        (BOX + TUMOUR, "slab.spots", "ends 4.7"),
        (WALL + TUMOUR.replace("5.5 0.2 m", "0.5 0 m"), "wall.spots", "ends 0.085 m"),
        (SQUARE + TUMOUR, "square.spots", "ends 4.8"),
        (BOX + 'damping = "50000 N s/m"', "slab.damping", "act faster on 0.0315 kg than one period"),
        (BOX.replace("900 N/m", "1e5 N/m"), "slab.stiffness", "1e+05 N/m act faster"),
        (BOX + 'layers = [{ thickness = "2 mm", stiffness = "1e5 N/m" }]', "slab.layers", "act faster"),
        (BOX + TUMOUR.replace("5.5", "0.5").replace("3 }", "90 }"), "slab.spots", "8.1e+04 N/m"),
        (
            WALL + BRAKE,
            "brake.damping",
            "90 N s/m",
        ),
        (
            WALL + HELP,
            "help.soft",
            "9e+04 N/m",
        ),
        (WALL.replace("0.5 0.1 m", "5 0.1 m"), "wall.point", "is 4.2 m away from everything that"),
        (BOX.replace("0.5 0.2 m", "5 0.2 m"), "slab.point", "is 4 m away from everything"),
        (WALL + BOX.replace("0.5 0.2 m", "5 0.2 m"), "slab.point", "is 4 m away from everything"),
        (SQUARE.replace('"0.', '"9.'), "square.vertices", "m away from everything that the hand can reach"),
        (BOX.replace("0.4 0.2 m", "0.4 -0.2 m"), "slab.size", "is out of range"),
        (BOX.replace("0.4 0.2 m", "0.4 0.01 m"), "slab.edge", "eighth of the least side of 0.01 m"),
        (BOX.replace("0.4 0.2 m", "0.4 0 m"), "slab.size", "is out of range"),
    ],
)  # fmt: skip
def test_a_body_that_makes_no_sense_is_named_with_its_line(body: str, key: str, problem: str) -> None:
    named, told, line = refusal(body)
    assert named.startswith(f"rhi.bodies.{key}") and problem in told
    word = key.split(".")[1]
    assert line.startswith((word, "[rhi.bodies.slab]" if word == "edge" else word))


@pytest.mark.parametrize(
    ("change", "key", "problem"),
    [
        (
            ('home = "0 0 0 0 rad"', 'home = "2 0 0 0 rad"'),
            "rhi.task.home",
            "on one of the limits of motor 1",
        ),
        (
            ('posture = "1.024066', 'posture = "1.96'),
            "simulation.rhi.posture",
            "in the end stop of the limits",
        ),
        (("rho = 0.003", "rho = 9.5"), "rhi.saturation.rho", "makes a transition of up to 1.6"),
        (("rho = 0.003", "rho = 1e-9"), "rhi.saturation.rho", "makes a transition of up to 1.6"),
        (("leave = 0.7", "leave = 0"), "rhi.saturation.leave", "no posture turns"),
        (("come_back = 0.95", "come_back = 1"), "rhi.saturation.come_back", "no posture turns back"),
    ],
)
def test_a_parameter_without_sense_is_named_with_its_line(
    change: tuple[str, str], key: str, problem: str
) -> None:
    named, told, line = refusal(WALL, change)
    assert named == key and problem in told
    assert line.startswith(key.split(".")[-1])


def test_what_is_wrong_in_several_places_is_told_at_once() -> None:
    body = BOX + TUMOUR + '\nlayers = [{ thickness = "2 m", stiffness = "500 N/m" }]'
    home, rho = ('home = "0 0 0 0 rad"', 'home = "2 0 0 0 rad"'), ("rho = 0.003", "rho = 9.5")
    at = "rhi.bodies.slab"
    keys = {f"{at}.spots[0].point", f"{at}.layers", "rhi.task.home", "rhi.saturation.rho"}
    assert findings((WALL, body), home, rho).keys() == keys


def test_no_transition_at_all_is_none_that_is_too_short() -> None:
    assert not findings(("rho = 0.003", "rho = 0"), ("scan = 4000", "scan = 200"))


def test_a_negative_count_of_postures_is_told_what_to_be() -> None:
    named, told, line = refusal(WALL, ("scan = 200", "scan = -1"))
    assert named == "rhi.null_space.scan" and ">= 0" in told and line.startswith("scan")


def test_who_finds_no_posture_at_a_wall_names_it() -> None:
    """As near to what random postures reach as one may be that a scan would find."""
    named, told, line = refusal(WALL.replace("0.5 0.1 m", "0.83 0.1 m"))
    assert named == "rhi.bodies.wall" and "no posture within the motors' limits" in told
    assert line.startswith("[rhi.bodies.wall]")


def remarks(*changes: tuple[str, str], machine: str = "rhi") -> list[str]:
    text = changed(*changes, machine=machine)
    parsed = config.parse(text, "m.toml")
    urdf = {"rhi": "rhi.urdf"}.get(machine, "panda.urdf")
    return told(config.Loaded(machine, parsed, text, "m.toml", read_text(urdf), urdf))


def test_a_wall_that_may_chatter_in_the_simulated_hand_is_remarked() -> None:
    (remark,) = remarks(('stiffness = "1000 N/m"', 'stiffness = "25000 N/m"'))
    assert "'wall' may chatter: 2.5e+04 N/m at 1000 Hz want 37.5 N s/m of damping" in remark
    for machine in ("rhi", "panda_rhi", "panda_stamp"):
        assert not remarks(machine=machine)


def test_a_hand_that_pulls_from_the_beginning_is_remarked() -> None:
    (remark,) = remarks(('posture = "1.024066', 'posture = "1.5'))
    assert "the simulated hand begins 0.12 m" in remark and "nothing starts before it lets go" in remark


JOLTS = 3e-3
"""[m/s], in the mean: of the walls below at most 0.6e-3 or at least 15e-3."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tissue", "swings"),
    [
        ('stiffness = "1000 N/m"', False),
        ('stiffness = "20000 N/m"', False),
        ('stiffness = "60000 N/m"', True),
        ('stiffness = "1000 N/m"\ndamping = "30 N s/m"', False),
        ('stiffness = "1000 N/m"\ndamping = "100 N s/m"', True),
    ],
)
def test_what_is_refused_swings_up_in_simulation_and_what_is_not_does_not(
    tissue: str, swings: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Told by the handle in a light touch: how far its speed changes otherwise than in the tick before."""
    change = ('stiffness = "1000 N/m"', tissue)
    assert bool(findings(change)) == swings
    text = changed(change, ("scan = 4000", "scan = 300"), machine="rhi")
    monkeypatch.setattr(check, "check_walls", lambda *_: [])
    parsed = config.parse(text, "rhi.toml")
    bench = Bench(config.Loaded("rhi", parsed, text, "rhi.toml", read_text("rhi.urdf"), "rhi.urdf"))
    bench.run(bench.ticks(8.3))
    machine: Any = bench.cycle.machine
    speeds = []
    for _ in range(bench.ticks(0.8)):
        bench.run(1)
        speeds.append(machine._arm.velocity.copy())
    jolts = np.linalg.norm(np.diff(speeds, 2, axis=0), axis=1)
    assert (np.sqrt(np.mean(jolts**2)) > JOLTS) == swings


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
