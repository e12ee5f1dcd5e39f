"""The linter refuses what pinocchio would load and a machine would not survive."""

import re
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.configs.ranges import RANGES
from hapticd.models import ModelError, Robot, lint
from hapticd.models.findings import MOST_TOLD
from hapticd.models.grammar import JOINTS, ROBOT
from hapticd.models.linter import MAX_LINKS
from hapticd.models.reader import MAX_NAME
from hapticd.models.xml_tree import MAX_ATTRIBUTES, MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS

GOOD = read_text("giant.urdf")
LIMIT_2 = '<limit effort="260.0" velocity="2.5" lower="0.45" upper="2.4" />'


def test_the_giant_passes() -> None:
    lint(GOOD, "giant.urdf")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (LIMIT_2, '<limit effort="260.0" velocity="2.5" lower="2.4" upper="0.45" />', "not below upper"),
        (LIMIT_2, "", "no <limit>"),
        (LIMIT_2, '<limit effort="260.0" velocity="2.5" upper="2.4" />', "lacks 'lower'"),
        (LIMIT_2, '<limit effort="260.0" velocity="0" lower="0.45" upper="2.4" />', "velocity = 0"),
        (LIMIT_2, '<limit effort="-1" velocity="2.5" lower="0.45" upper="2.4" />', "effort = -1"),
        (LIMIT_2, '<limit effort="260.0" velocity="2.5" lower="26" upper="137" />', "degrees"),
        (LIMIT_2, '<limit effort="260.0" velocity="2.5" lower="nan" upper="2.4" />', "finite number"),
        (LIMIT_2, '<limit effort="260.0" velocity="inf" lower="0.45" upper="2.4" />', "finite number"),
        ('<axis xyz="0 0 1" />', '<axis xyz="0 0 0" />', "axis has length 0"),
        ('<axis xyz="0 0 1" />', '<axis xyz="0 0" />', "3 finite numbers"),
        ('<mass value="13.1" />', '<mass value="-13.1" />', "mass = -13.1"),
        ('<child link="link_1" />', '<child link="nowhere" />', "does not exist"),
        ('<child link="link_1" />', '<child link="link_2" />', "two parent joints"),
        ('type="continuous"', 'type="floating"', "type 'floating'"),
        ('<joint name="joint_2"', '<joint name="joint_1"', "a second <joint> 'joint_1'"),
        ('<joint name="joint_2"', "<joint", "without a name"),
        ('<cylinder radius="0.115" length="0.07" />', '<mesh filename="../../etc/passwd" />', "outside"),
        ("<robot name", "<!DOCTYPE x [<!ENTITY a 'b'>]><robot name", "document type"),
        ("</robot>", "", "not XML"),
        ("<robot name", "<robt name", "not XML"),
        ('<origin xyz="0.0 0.0 0.045"', '<origin xyz="nan nan nan"', "3 finite numbers"),  # of a shape
        ('radius="0.115"', 'radius="1e300"', "radius = 1e+300 is out of range"),
        ('<mass value="13.1" />', '<mass value="1e300" />', "mass = 1e+300 is out of range"),
        ('<mass value="13.1" />', '<mass value="1e999" />', "1 finite number"),
        ('<mass value="13.1" />', '<mass value="13_1" />', "1 finite number"),
        ('<mass value="13.1" />', '<mass value="1e-320" />', "1 finite number"),
        ('<mass value="13.1" />', '<mass value="13.1 13.1" />', "1 finite number"),
        ('<mass value="13.1" />', '<mass value="" />', "1 finite number"),
        ('<mass value="13.1" />', '<mass value="13.1" value="13.1" />', "not XML: duplicate attribute"),
        ('<mass value="13.1" />', '<mass value="13.1" /><mass value="13.1" />', "a second <mass>"),
        ('<mass value="13.1" />', '<mass value="13.1" unit="kg" />', "no attribute 'unit'"),
        ('<mass value="13.1" />', "", "no <mass>"),
        ('<mass value="13.1" />', '<mass value="13.1">heavy</mass>', "the text 'heavy'"),
        ('<mass value="13.1" />', '<mass value="0.0002" />', "sqrt(moment / mass)"),
        (LIMIT_2, LIMIT_2 * 2, "a second <limit>"),
        (LIMIT_2, LIMIT_2.replace("260.0", "2.6e9"), "effort = 2.6e+09 is out of range"),
        (LIMIT_2, LIMIT_2.replace("2.5", "1e300"), "velocity = 1e+300 is out of range"),
        ('<axis xyz="0 0 1" />', '<axis xyz="0 0 1" rpy="0 0 0" />', "no attribute 'rpy'"),
        ('<dynamics damping="3.0" />', '<dynamics damping="-3.0" />', "damping = -3"),
        ('<dynamics damping="3.0" />', '<dynamics damping="3.0" /><mimic joint="joint_2" />', "<mimic>"),
        ('<dynamics damping="3.0" />', '<dynamics damping="3.0" /><safety_controller />', "soft limits"),
        ('<dynamics damping="3.0" />', '<dynamics damping="3.0" /><dynamic />', "did you mean dynamics?"),
        ("<robot name", '<?xml version="1.0" encoding="utf-16"?><robot name', "not XML"),
        ('<parent link="base" />', "", "no <parent>"),
        ('<link name="base">', '<link name="universe">', "means the world"),
        ('<link name="link_1">', '<link name="joint_1">', "a link and of a joint"),
        ('<capsule name="base_0" />', '<capsule name="base_9" />', "none of the link's collision cylinders"),
        ('<capsule name="base_0" />', '<capsule name="base_1" />', "a second <capsule> 'base_1'"),
        ('rgba="0.8 0.81 0.83 1"', 'rgba="0.8 0.81 0.83 255"', "rgba = 255 is out of range"),
        ("</robot>", "<xacro:macro /></robot>", "expand it first"),
        ("</robot>", '<robot name="x" /></robot>', "unknown element <robot>"),
        ("</robot>", "words</robot>", "the text 'words'"),
        ('<robot name="giant">', "<robot>", "without a name"),
    ],
)
def test_a_dangerous_description_is_refused_with_line_reason_and_fix(
    old: str, new: str, problem: str
) -> None:
    assert old in GOOD
    text = GOOD.replace(old, new, 1)
    with pytest.raises(ModelError) as error:
        lint(text, "arm.urdf")
    assert problem in error.value.problem + error.value.fix
    assert error.value.fix
    assert re.match(r"arm\.urdf:\d+: ", str(error.value))


def test_an_inertia_that_no_body_has_is_refused() -> None:
    text = re.sub(r'ixx="[^"]*"', 'ixx="99"', GOOD, count=1)
    with pytest.raises(ModelError, match="no rigid body"):
        lint(text, "arm.urdf")


def test_a_moving_link_without_mass_is_refused() -> None:
    text = re.sub(
        r"<link name=\"link_4\">\s*<inertial>.*?</inertial>", '<link name="link_4">', GOOD, flags=re.S
    )
    with pytest.raises(ModelError, match="moves a link without mass"):
        lint(text, "arm.urdf")


def test_something_that_is_no_urdf_is_refused() -> None:
    with pytest.raises(ModelError, match="root element is <svg>"):
        lint("<svg></svg>", "arm.urdf")
    with pytest.raises(ModelError, match="bytes of XML"):
        lint(" " * (5 << 20), "arm.urdf")


def test_a_loose_link_is_refused() -> None:
    text = GOOD.replace("</robot>", '<link name="loose"/></robot>')
    with pytest.raises(ModelError, match="2 links without a parent"):
        lint(text, "arm.urdf")


def test_what_no_machine_has_is_named_with_its_place_and_range() -> None:
    with pytest.raises(ModelError) as error:
        lint(GOOD.replace('<mass value="13.1" />', '<mass value="13100" />'), "arm.urdf")
    line = GOOD[: GOOD.index('<mass value="13.1" />')].count("\n") + 1
    problem = "link 'link_1': mass = 13100 is out of range; give 0.0001 to 1000 kg"
    assert str(error.value).startswith(f"arm.urdf:{line}: {problem}")


def test_a_loop_beside_the_tree_is_refused() -> None:
    loop = "".join(
        f'<link name="ring_{i}"/><joint name="ring_joint_{i}" type="fixed"><origin xyz="0 0 0" rpy="0 0 0"/>'
        f'<parent link="ring_{i}"/><child link="ring_{(i + 1) % 3}"/></joint>'
        for i in range(3)
    )
    with pytest.raises(
        ModelError, match="no joint connects to 'base': ring_0, ring_1, ring_2; break the loop"
    ):
        lint(GOOD.replace("</robot>", f"{loop}</robot>"), "arm.urdf")


def chain(links: int) -> str:
    """Fixed links in a row."""
    joints = "".join(
        f'<link name="l{i}"/><joint name="j{i}" type="fixed"><origin xyz="0 0 0" rpy="0 0 0"/>'
        f'<parent link="l{i - 1}"/><child link="l{i}"/></joint>'
        for i in range(1, links)
    )
    return f'<robot name="r"><link name="l0"/>{joints}</robot>'


def test_a_long_chain_loads_up_to_the_stated_length_and_is_refused_beyond() -> None:
    assert Robot.from_urdf(chain(200), "chain.urdf").nv == 0
    for links in (201, 2000):
        with pytest.raises(ModelError, match=f"{links} links; at most 200"):
            lint(chain(links), "chain.urdf")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<robot name='r'>" + "<a>" * 100_000 + "</a>" * 100_000 + "</robot>", "nested more than 16 deep"),
        ("<robot name='r'>" + "<gazebo>" * 30 + "</gazebo>" * 30 + "</robot>", "nested more than 16 deep"),
        ("<robot name='r'>" + "<material/>" * 30_000 + "</robot>", "more than 20000 elements"),
        ("<robot " + " ".join(f"a{i}='1'" for i in range(1000)) + "/>", "1000 attributes"),
        ("<robot name='r'>" + "x<!-- -->" * 300_000 + "</robot>", "the text 'xxxx"),
        ("<robot name='" + "r" * 100_000 + "'/>", "1 to 200 printable characters"),
        ("<robot name='r'><link name='\ud800'/></robot>", "surrogate"),
        ("<robot name='r\x00'/>", "not XML"),
        ("", "not XML"),
    ],
)
def test_a_hostile_description_costs_an_error_and_little_time(text: str, problem: str) -> None:
    start = time.process_time()
    with pytest.raises(ModelError) as error:
        lint(text, "bomb.urdf")
    assert time.process_time() - start < 1.0
    assert problem in str(error.value) and len(str(error.value)) < 500


def test_a_robot_of_another_house_is_led_to_what_is_asked_for() -> None:
    body = '<mass value="3"/><inertia ixx=".3" ixy="0" ixz="0" iyy=".3" iyz="0" izz=".3"/></inertial></link>'
    text = f"""<?xml version="1.0" ?>
<robot name="arm">
  <link name="base"><visual><geometry><mesh filename="package://arm/base.dae"/></geometry></visual></link>
  <joint name="shoulder" type="revolute"><mimic joint="other"/>
    <origin rpy="0 0 0" xyz="0 0 0.333"/><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit effort="87" lower="-2.9" upper="2.9" velocity="2.1"/>
  </joint>
  <link name="upper"><inertial>{body}
  <gazebo reference="upper"><material>Gazebo/Grey</material></gazebo>
</robot>"""
    for problem, old, new in (
        ("3: mesh 'package://arm/base.dae' lies outside the description's folder", "package://arm/", ""),
        ("4: joint 'shoulder': <mimic>; a joint that follows another", '<mimic joint="other"/>', ""),
    ):
        with pytest.raises(ModelError) as error:
            lint(text, "arm.urdf")
        assert f"arm.urdf:{problem}" in str(error.value)
        text = text.replace(old, new)
    lint(text, "arm.urdf")


@pytest.mark.parametrize(
    ("old", "new", "written"),
    [
        (r' rpy="[^"]*"', "", ' rpy="0 0 0"'),
        (r'(?<=<origin )xyz="[^"]*"', "", 'xyz="0 0 0"'),
        (r'<origin [^>]*/>', "", '<origin xyz="0 0 0" rpy="0 0 0" />'),
        (r"<origin [^>]*/>", "<origin />", '<origin xyz="0 0 0" rpy="0 0 0" />'),
        (r"<dynamics [^>]*/>", "", '<dynamics damping="0" />'),
        (r"<dynamics [^>]*/>", "<dynamics />", '<dynamics damping="0" />'),
        (r"<axis [^>]*/>", "", '<axis xyz="1 0 0" />'),
    ],
)  # fmt: skip
def test_what_a_urdf_may_leave_out_means_what_its_specification_says(
    old: str, new: str, written: str
) -> None:
    short, long = (re.sub(old, what, GOOD) for what in (new, written))
    assert len(short) < len(long)
    model, same = Robot.from_urdf(short, "arm.urdf"), Robot.from_urdf(long, "arm.urdf")
    assert model.model == same.model
    assert [shape.T.tolist() for shape in model.shapes] == [shape.T.tolist() for shape in same.shapes]


def test_a_fixed_joint_may_have_an_axis_that_nobody_reads() -> None:
    parts = '<axis xyz="0 0 0"/><limit effort="0" velocity="0"/><dynamics damping="0"/>'
    text = GOOD.replace('type="fixed">', f'type="fixed">{parts}')
    assert text != GOOD
    assert Robot.from_urdf(text, "arm.urdf").model == Robot.from_urdf(GOOD, "arm.urdf").model


def test_everything_wrong_is_told_at_once_each_with_its_line() -> None:
    wrong = (
        (LIMIT_2, '<limit effort="-1" velocity="x" lower="2" upper="1" />', ("effort = -1", "finite number")),
        ('<mass value="13.1" />', "", ("no <mass>",)),
        ('<axis xyz="0 0 1" />', '<axis xyz="0 0 3" />', ("axis has length 3",)),
        ('<child link="link_3" />', '<child link="nowhere" />', ("'nowhere' does not exist",)),
    )
    text = GOOD
    for old, new, _ in wrong:
        text = text.replace(old, new, 1)
    with pytest.raises(ModelError) as error:
        lint(text, "arm.urdf")
    found = {found.problem + found.fix: found.line for found in error.value.findings}
    lines = text.splitlines()
    for _, new, problems in wrong:
        for problem in problems:
            (line,) = [line for told, line in found.items() if problem in told]
            assert not new or new.split()[0] in lines[line - 1] or "joint" in lines[line - 1]
    assert len(found) == sum(len(problems) for *_, problems in wrong)
    assert list(found.values()) == sorted(found.values())
    assert str(error.value).count("arm.urdf:") == len(found)


def test_of_very_much_that_is_wrong_the_beginning_is_told() -> None:
    with pytest.raises(ModelError) as error:
        lint(GOOD.replace("</robot>", "<lnk/>words" * 3000 + "</robot>"), "arm.urdf")
    assert len(error.value.findings) == MOST_TOLD + 1
    assert re.search(r"arm\.urdf: \d+ more findings", str(error.value))


def test_entities_do_not_explode() -> None:
    bomb = "<!DOCTYPE r [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;'>]><robot name='&b;'/>"
    with pytest.raises(ModelError, match="document type"):
        lint(bomb, "bomb.urdf")


def test_other_ways_to_write_the_same_stay_the_same() -> None:
    text = read_text("rhi.urdf")
    same = Robot.from_urdf(text, "rhi.urdf").model
    for old, new in (
        ('<axis xyz="0 0 1" />', "<axis\n  xyz = '0. +0 1e0'></axis>"),
        ("<robot", "<!-- a comment --><robot"),
        ("<parent", "<?an instruction?><!-- <limit/> --><parent"),
        ('xyz="0.254 0 0"', 'xyz="  2.54e-1\t0.0 -0 "'),
        ("\n", "\r\n"),
        ("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" xmlns="http://www.ros.org"'),
        ("</robot>", '<gazebo reference="link_1"><mu1>inf</mu1></gazebo><transmission name="t"/></robot>'),
        ("joint_1", "Gelenk-1.a/b"),
        (
            '<link name="base" />',
            '<link name="base"><visual><geometry><mesh filename="a b.dae"/></geometry></visual></link>',
        ),
    ):
        assert old in text
        model = Robot.from_urdf(text.replace(old, new), "rhi.urdf").model
        assert [p.homogeneous.tolist() for p in model.jointPlacements] == [
            p.homogeneous.tolist() for p in same.jointPlacements
        ]
        assert model.inertias.tolist() == same.inertias.tolist()
        assert model.effortLimit.tolist() == same.effortLimit.tolist()


def test_the_order_of_elements_and_attributes_means_nothing() -> None:
    root = ET.fromstring(read_text("rhi.urdf"))
    for element in list(root.iter()):
        element[:] = list(element)[::-1]
        element.attrib = dict(reversed(element.attrib.items()))
    turned = Robot.from_urdf(ET.tostring(root, encoding="unicode"), "rhi.urdf")
    assert turned.model == Robot.from_urdf(read_text("rhi.urdf"), "rhi.urdf").model


def test_pinocchio_gets_what_was_understood_and_nothing_else() -> None:
    understood = lint(GOOD, "giant.urdf")
    assert {element.tag for element in ET.fromstring(understood).iter()} == {
        *("robot", "link", "inertial", "origin", "mass", "inertia"),
        *("joint", "parent", "child", "axis", "limit", "dynamics"),
    }
    own, full = pin.buildModelFromXML(understood), pin.buildModelFromXML(GOOD)
    assert own == full


def test_the_manual_lists_the_ranges() -> None:
    manual = (Path(__file__).parents[2] / "docs" / "files.md").read_text()
    for name, allowed in RANGES.items():
        assert f"| {name} | {allowed} | {allowed.why} |" in manual
    for tag in (*ROBOT.ignored, *JOINTS["fixed"].ignored, *JOINTS["fixed"].refused, *JOINTS, *ROBOT.known):
        assert f"`{tag}`" in manual
    for bound in (MAX_ELEMENTS, MAX_DEPTH, MAX_ATTRIBUTES, MAX_LINKS, MAX_NAME, MAX_BYTES >> 20):
        assert f" {bound} " in manual
