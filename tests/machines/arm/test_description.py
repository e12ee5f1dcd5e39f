"""An arm is taken out of anybody's URDF, and weighs and reaches what it did there."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hapticd.machines.arm.errors import InitError
from hapticd.machines.arm.guess import guess
from hapticd.machines.arm.urdf_read import read_arm
from hapticd.machines.arm.urdf_write import write_urdf
from hapticd.models import Robot

from .arms import gripper, joint, limit, link, planar, random_arm, robot, scara

CHAIN = (
    '<link name="base"/>',
    *(link(f"l{i}", 1.0, "0.1 0 0") for i in range(1, 4)),
    *(
        joint(
            f"q{i}", "revolute", (f"l{i - 1}" if i > 1 else "base", f"l{i}"), "0.2 0 0", "0 0 1", limit(-2, 2)
        )
        for i in range(1, 4)
    ),
)

FOLLOWER = link("other", 0.1) + joint(
    "q5", "revolute", ("l4", "other"), "0 0 0", "0 0 1", limit(-2, 2) + '<mimic joint="q4"/>'
)


def test_fingers_and_branches_are_frozen_and_the_arm_moves_as_before() -> None:
    arm = read_arm(gripper(), "g.urdf", None)
    assert list(arm.joints) == [f"l{i}_joint" for i in range(1, 7)]  # a link has the name already
    said = " ".join(arm.remarks)
    assert "frozen where they stand, with what they carry: left, right" in said
    assert "'flange'" in said  # the tip
    # pinocchio finds no frame whose name a link and a joint share
    before = pin.buildModelFromXML(
        gripper().replace('joint name="l', 'joint name="j').replace('"jeft"', '"left"')
    )
    fingers = [before.getJointId(name) for name in ("left", "right")]
    before = pin.buildReducedModel(before, fingers, np.array([0.0] * 6 + [0.01, 0.01]))
    after = Robot.from_urdf(guess(arm).urdf, "after")
    data, rng = before.createData(), np.random.default_rng(1)
    for q in rng.uniform(-2.0, 2.0, (5, 6)):
        pin.framesForwardKinematics(before, data, q)
        flange = data.oMf[before.getFrameId("flange")].homogeneous
        np.testing.assert_allclose(after.placement(q, "flange"), flange, atol=1e-12)
        weight = pin.computeGeneralizedGravity(before, data, q).copy()
        # the handle hangs on it
        frame = after.frame("handle")
        world = pin.LOCAL_WORLD_ALIGNED
        J = pin.computeFrameJacobian(after.model, after.data, q, frame, world)
        T = after.placement(q, "handle")
        lever = T[:3, :3] @ [0.0, 0.0, -0.03]
        force = np.array([0.0, 0.0, 9.81 * arm.handle])
        handle = J[:3].T @ force + J[3:].T @ np.cross(lever, force)
        found = pin.computeGeneralizedGravity(after.model, after.data, q)
        np.testing.assert_allclose(found, weight + handle, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "tip", "problem"),
    [
        (planar(), "gripper", "there is no link 'gripper'; .*candidates: hand"),
        (planar(), "hnad", "did you mean 'hand'?"),
        (planar(), "fore", r"2 joints \(q1, q2\) can move between 'world' and 'fore'"),
        (robot('<link name="base"/>'), None, "no joint can move"),
        (robot(*CHAIN).replace("<inertial>", "<!--").replace("</inertial>", "-->"), None, "has a mass"),
        (robot(*CHAIN, '<link name="lost"/>'), None, "2 links have no parent"),
        (robot(*CHAIN).replace('link="base"', 'link="l3"'), None, "2 links have no parent|form a loop"),
        (robot(*CHAIN).replace('child link="l3"', 'child link="l2"'), None, "two parent joints"),
        (robot(*CHAIN).replace('link="l2"', 'link="l9"'), None, "'l9', which is not there"),
        (robot(*CHAIN).replace("0.2 0 0", "0.2 zero 0", 1), None, "give 3 finite numbers"),
        (robot(*CHAIN).replace('axis xyz="0 0 1"', 'axis xyz="0 0 0"', 1), None, "no direction"),
        (robot(*CHAIN).replace('"q2" type="revolute"', '"q2" type="floating"'), None, "is floating"),
        (robot(*CHAIN).replace("0.2 0 0", "${length} 0 0", 1), None, "this is a xacro"),
        (planar(), "base", r"no joint can move between .* --tip: hand"),
        (robot(*CHAIN), "l1", r"1 joint \(q1\) can move"),
        (robot(), None, "there are no links"),
        (robot(*CHAIN[:3], CHAIN[4], CHAIN[5]), None, "2 joints .* no way from 'base' .* 3 to 7 joints"),
        ("<sdf/>", None, "the root element is <sdf>"),
    ],
)
def test_what_is_no_arm_is_refused_with_a_reason(text: str, tip: str | None, problem: str) -> None:
    with pytest.raises(InitError, match=problem):
        read_arm(text, "x.urdf", tip)


def test_an_arm_that_branches_before_anything_moves_needs_a_tip() -> None:
    other = robot(*CHAIN)
    left = "".join(part.replace('"l', '"left').replace('"q', '"p') for part in CHAIN[1:])
    both = other.replace("</robot>", left.replace('"base"', '"base"') + "</robot>")
    with pytest.raises(InitError, match=r"branches at 'base'.*--tip with one of l3, left3"):
        read_arm(both, "x.urdf", None)
    arm = read_arm(both, "x.urdf", "left3")
    assert list(arm.joints) == ["p1", "p2", "p3"]
    assert "left out, for nothing that moves carries them: q1" in arm.remarks


def test_what_no_machine_may_have_is_mended_and_said() -> None:
    text = robot(*CHAIN).replace('effort="40"', 'effort="0"', 1).replace('velocity="3"', 'velocity="0"', 1)
    text = text.replace('ixx="0.001"', 'ixx="0.9"', 1)
    made = guess(read_arm(text, "x.urdf", None))
    said = " ".join(made.arm.remarks)
    for words in ("no effort is given of q1", "no speed is given of q1", "'l1' belongs to no rigid body"):
        assert words in said
    Robot.from_urdf(made.urdf, "x")


def test_drives_that_nobody_knows_bear_a_gentle_hand() -> None:
    text = robot(*CHAIN)
    known, unknown = (guess(read_arm(each, "x.urdf", None)) for each in (text, text.replace('"40"', '"0"')))
    assert known.force == 18.0 and unknown.force == 20.0
    assert f"sensor is for at most {unknown.scales[0]:g} N" in " ".join(unknown.arm.remarks)
    small = text.replace('"40"', '"0"').replace('mass value="1"', 'mass value="0.1"')
    light = guess(read_arm(small, "x.urdf", None))
    weight = 9.81 * (0.3 + light.arm.handle)
    assert 0.9 * weight < light.force < 20.0


def test_a_joint_without_limits_turns_without_end() -> None:
    text = robot(*CHAIN).replace('lower="-2" upper="2" ', "", 1)
    made = guess(read_arm(text, "x.urdf", None))
    assert "'q1' has no limits: taken to be continuous" in made.arm.remarks
    assert made.upper[0] == float("inf")
    locked = robot(*CHAIN).replace('lower="-2" upper="2" ', 'lower="0" upper="0" ', 1)
    with pytest.raises(InitError, match="2 joints"):
        read_arm(locked, "x.urdf", None)


def test_a_joint_that_moves_nothing_gets_a_mass() -> None:
    text = robot(*CHAIN).replace(link("l2", 1.0, "0.1 0 0"), '<link name="l2"/>')
    arm = read_arm(text, "x.urdf", None)
    assert any("'l2' has no mass, and a joint moves it" in remark for remark in arm.remarks)


@pytest.mark.parametrize("seed", range(8))
def test_any_arm_keeps_its_joints(seed: int) -> None:
    text = random_arm(seed)
    before, arm = pin.buildModelFromXML(text), read_arm(text, "r.urdf", None)
    assert list(arm.joints) == list(before.names)[1:]
    assert "package://" not in write_urdf(arm)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('joint name="q4"', 'joint name="the_Gripper"'),
        ('"l4"', '"moving_jaw"'),
        ("</robot>", FOLLOWER + "</robot>"),
    ],
)
def test_a_last_joint_that_looks_like_a_grippers_is_named(old: str, new: str) -> None:
    last = link("l4", 1.0) + joint("q4", "revolute", ("l3", "l4"), "0.2 0 0", "0 0 1", limit(-2, 2))
    tool = '<link name="tcp"/>' + joint("t", "fixed", ("l3", "tcp"), "0 0 0", "1 0 0", "")
    text = robot(*CHAIN, last, tool)
    assert not [remark for remark in read_arm(text, "x.urdf", None).remarks if "gripper" in remark]
    arm = read_arm(text.replace(old, new), "x.urdf", None)
    assert [remark for remark in arm.remarks if "looks like a gripper's" in remark and "--tip tcp" in remark]
    without = read_arm(text.replace(old, new), "x.urdf", "tcp")
    assert list(without.joints) == ["q1", "q2", "q3"]
    assert not [remark for remark in without.remarks if "looks like" in remark]


def test_sliding_joints_stay_sliding_joints() -> None:
    made = guess(read_arm(scara(), "s.urdf", None))
    assert made.sliding == [False, False, True, False]
    assert [("x", "y", "z", "rx", "ry", "rz")[i] for i in made.directions] == ["x", "y", "z", "rz"]
