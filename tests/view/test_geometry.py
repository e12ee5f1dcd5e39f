import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.models import Robot
from hapticd.view.geometry import Geometry


@pytest.mark.parametrize("machine", ["giant", "panda", "rhi"])
def test_joints_and_handle_are_where_the_model_has_them(machine: str) -> None:
    urdf = read_text(f"{machine}.urdf")
    robot = Robot.from_urdf(urdf, machine)
    geometry = Geometry(robot, urdf, "handle")
    q = np.random.default_rng(1).uniform(-0.4, 0.4, robot.nv)
    poses, handle = geometry.place(q)
    np.testing.assert_allclose(handle, robot.placement(q, "handle")[:3, 3], atol=1e-5)
    for joint, name in enumerate(robot.names):
        found = pin.XYZQUATToSE3(np.array(poses[7 * joint : 7 * joint + 7])).homogeneous
        np.testing.assert_allclose(found, robot.placement(q, name), atol=3e-5)


def test_a_model_shows_its_own_shapes() -> None:
    urdf = read_text("giant.urdf")
    shapes = Geometry(Robot.from_urdf(urdf, "giant"), urdf, "handle").shapes
    assert len(shapes) == urdf.count("<visual")
    (post,) = (s for s in shapes if np.allclose(s.pose[:3], [-2.35, -2.75, -0.815]))
    assert (post.kind, post.joint) == ("box", 0)
    np.testing.assert_allclose(post.size, [0.12, 0.12, 2.47])


def test_a_skeleton_joins_every_joint_to_the_next() -> None:
    """Ends of its capsules, without a shape in the model: from a joint's origin to that of the next."""
    urdf = read_text("panda.urdf")
    assert "<visual" not in urdf
    robot = Robot.from_urdf(urdf, "panda")
    links = [s for s in Geometry(robot, urdf, "handle").shapes if s.kind == "capsule"]
    for link in links:
        placement = pin.XYZQUATToSE3(np.array(link.pose))
        half = placement.rotation[:, 2] * link.size[1] / 2
        np.testing.assert_allclose(placement.translation - half, 0.0, atol=2e-5)
        end = placement.translation + half
        children = [robot.model.jointPlacements[j].translation for j in range(1, robot.model.njoints)]
        tips = [*children, robot.model.frames[robot.frame("handle")].placement.translation]
        assert min(float(np.linalg.norm(end - tip)) for tip in tips) < 3e-5
    assert len(links) >= 5
