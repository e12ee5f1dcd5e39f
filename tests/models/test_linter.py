"""The linter refuses what pinocchio would load and a machine would not survive."""

import re

import pytest
from hapticd.configs import read_text
from hapticd.models import ModelError, lint

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
