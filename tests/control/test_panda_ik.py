"""The closed form against pinocchio's forward kinematics."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.panda_ik import PandaIk
from hapticd.experiments.moved_arm import HOME, panda
from hapticd.models import Array, ModelError, Robot

ROBOT = panda()
AT = ROBOT.frame("handle")


def forward(q: Array) -> tuple[Array, Array]:
    pin.framesForwardKinematics(ROBOT.model, ROBOT.data, q)
    pose = ROBOT.data.oMf[AT]
    return pose.translation.copy(), np.ascontiguousarray(pose.rotation)


def test_it_recovers_ten_thousand_random_configurations() -> None:
    ik, rng = PandaIk(ROBOT, "handle"), np.random.default_rng(1)
    worst = 0.0
    for q in rng.uniform(ROBOT.lower, ROBOT.upper, (10_000, 7)):
        assert ik.nearest(*forward(q), float(q[6]), q)
        worst = max(worst, float(np.abs(ik.solution - q).max()))
    assert worst < 1e-9


def test_every_branch_reaches_the_pose_within_the_limits_and_all_eight_occur() -> None:
    ik, rng, most = PandaIk(ROBOT, "handle"), np.random.default_rng(2), 0
    for q in rng.uniform(ROBOT.lower, ROBOT.upper, (500, 7)):
        position, rotation = forward(q)
        found = ik.branches(position, rotation, float(q[6]))
        for each in found:
            p, R = forward(each)
            assert np.abs(p - position).max() < 1e-9 and np.abs(R - rotation).max() < 1e-9
            assert (each >= ROBOT.lower - 1e-9).all() and (each <= ROBOT.upper + 1e-9).all()
        gaps = [np.abs(a - b).max() for i, a in enumerate(found) for b in found[:i]]
        assert min(gaps, default=1.0) > 1e-6
        most = max(most, len(found))
    wide = PandaIk(ROBOT, "handle", beyond=10.0)
    counts = {
        len(wide.branches(*forward(q), float(q[6]))) for q in rng.uniform(ROBOT.lower, ROBOT.upper, (200, 7))
    }
    assert most >= 4 and max(counts) == 8


def test_the_nearest_branch_is_taken() -> None:
    ik, rng = PandaIk(ROBOT, "handle"), np.random.default_rng(3)
    for q in rng.uniform(ROBOT.lower, ROBOT.upper, (300, 7)):
        pose, near = forward(q), rng.uniform(ROBOT.lower, ROBOT.upper)
        assert ik.nearest(*pose, float(q[6]), near)
        found = ik.branches(*pose, float(q[6]), float(near[0]))
        distance = np.linalg.norm(found - near, axis=1)
        assert np.linalg.norm(ik.solution - near) == pytest.approx(distance.min())


def test_singular_postures_and_what_is_out_of_reach_give_no_nan() -> None:
    ik = PandaIk(ROBOT, "handle")
    aligned, straight = HOME.copy(), HOME.copy()
    aligned[1] = 0.0  # joints 1 and 3 turn about one axis
    straight[3] = -0.4676  # shoulder, joint 4 and wrist are in line
    for q in (aligned, straight, aligned * [1, 1, 1, 1, 0, 1, 1]):
        for shift in np.random.default_rng(4).normal(0.0, 1e-9, (50, 3)):
            position, rotation = forward(q)
            for near in (q, HOME):
                before = ik.solution.copy()
                if ik.nearest(position + shift, rotation, float(q[6]), near):
                    p, R = forward(ik.solution)
                    assert np.abs(p - position - shift).max() < 1e-7 and np.abs(R - rotation).max() < 1e-7
                else:
                    assert (ik.solution == before).all()
    assert ik.nearest(*forward(aligned), float(aligned[6]), aligned)
    np.testing.assert_allclose(ik.solution, aligned, atol=1e-6)
    for far in ([2.0, 0.0, 0.5], [0.0, 0.0, 5.0], [np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0]):
        assert not ik.nearest(np.array(far), np.eye(3), 0.0, HOME)
        assert np.isfinite(ik.solution).all()
    assert not ik.nearest(np.array([0.5, 0.0, 0.5]), np.eye(3), np.nan, HOME)


def test_the_base_may_stand_anywhere() -> None:
    base = pin.SE3(pin.exp3(np.array([0.3, -0.4, 1.0])), np.array([0.1, 0.4, 1.1]))
    ik = PandaIk(ROBOT, "handle", base.homogeneous)
    position, rotation = forward(HOME)
    moved = base * pin.SE3(rotation, position)
    assert ik.nearest(moved.translation.copy(), np.ascontiguousarray(moved.rotation), HOME[6], HOME)
    np.testing.assert_allclose(ik.solution, HOME, atol=1e-9)


def test_reach_tells_poses_that_some_joint_seven_allows() -> None:
    ik, rng = PandaIk(ROBOT, "handle"), np.random.default_rng(5)
    poses = [forward(q) for q in rng.uniform(ROBOT.lower, ROBOT.upper, (200, 7))]
    positions, rotations = np.array([p for p, _ in poses]), np.array([R for _, R in poses])
    assert ik.reach(positions, rotations, 120).mean() > 0.97
    assert not ik.reach(positions + np.array([0.0, 0.0, 2.5]), rotations, 120).any()


def test_another_arm_is_refused() -> None:
    model = ROBOT.model.copy()
    model.jointPlacements[6].translation = np.array([0.01, 0.0, 0.0])
    with pytest.raises(ModelError, match="joint 6 is not where"):
        PandaIk(Robot(model), "handle")
