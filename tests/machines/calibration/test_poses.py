"""Poses are inside all limits, and so are the ways between them; gravity comes from all around."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.machines.calibration.poses import choose, directions
from hapticd.machines.calibration.session import rig_of
from hapticd.models import Array, Robot
from hapticd.runtime.configuration.config import load
from hapticd.runtime.configuration.session import build

LOADED = load("panda")
RIG, ROBOT = rig_of(LOADED), build(LOADED).robot
FRAMES = [mount.frame for mount in RIG.mounts]
BOX = LOADED.config.arm.boxes[0]  # type: ignore[attr-defined]


def found(seed: int, count: int = 20) -> tuple[Array, float]:
    return choose(ROBOT, FRAMES, RIG.start, (RIG.lower, RIG.upper), RIG.inside, count, seed)


@pytest.mark.parametrize("seed", range(5))
def test_twenty_poses_and_the_ways_between_them_are_inside_and_well_conditioned(seed: int) -> None:
    places, worst = found(seed)
    assert len(places) == 20
    assert worst < 2.0
    down = directions(ROBOT, FRAMES[0], places)
    assert np.linalg.norm(down.mean(axis=0)) < 0.5  # all around: within a cone of 60 degrees it is 0.75
    here = RIG.start
    joints = np.array([joint.range for joint in LOADED.config.arm.joints.values()])  # type: ignore[attr-defined]
    for place in places:
        for q in here + np.linspace(0.0, 1.0, 50)[:, None] * (place - here):
            assert (q > joints[:, 0]).all() and (q < joints[:, 1]).all()
            at = ROBOT.placement(q, "handle")[:3, 3]
            assert (at > BOX.lower).all() and (at < BOX.upper).all()
        here = place


def test_the_same_seed_gives_the_same_poses_and_another_one_others() -> None:
    np.testing.assert_array_equal(found(1)[0], found(1)[0])
    assert not np.array_equal(found(1)[0], found(2)[0])


def test_an_arm_that_cannot_turn_its_sensor_finds_nothing_that_would_do() -> None:
    """All axes upright: gravity always comes from the same side."""
    links = "".join(
        f'<link name="l{i}"><inertial><origin xyz="0 0 0" rpy="0 0 0"/><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        for i in range(4)
    )
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        '<origin xyz="0.3 0 0" rpy="0 0 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-2" upper="2" effort="10" velocity="1"/><dynamics damping="0"/></joint>'
        for i in range(3)
    )
    robot = Robot.from_urdf(f'<robot name="scara">{links}{joints}</robot>', "scara.urdf")
    limits = np.full(3, -2.0), np.full(3, 2.0)
    places, worst = choose(robot, ["l3"], np.zeros(3), limits, lambda q: True, 20, 1)
    assert len(places) == 20 and worst == float("inf")


def test_nowhere_to_go_is_no_pose() -> None:
    places, worst = choose(ROBOT, FRAMES, RIG.start, (RIG.lower, RIG.upper), lambda q: False, 20, 1)
    assert places.shape == (0, 7) and worst == float("inf")
