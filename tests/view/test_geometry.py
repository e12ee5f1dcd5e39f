import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.models import Robot
from hapticd.runtime.configuration.config import load
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.scene import Grip
from hapticd.view.geometry import Geometry, drawn

HANDLE = Grip("", "handle")


@pytest.mark.parametrize("machine", ["giant", "panda", "rhi"])
def test_joints_and_handle_are_where_the_model_has_them(machine: str) -> None:
    urdf = read_text(f"{machine}.urdf")
    robot = Robot.from_urdf(urdf, machine)
    geometry = Geometry(robot, urdf, [HANDLE])
    q = np.random.default_rng(1).uniform(-0.4, 0.4, robot.nv)
    poses, handle, wrench = geometry.place(q.tolist(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert wrench == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    np.testing.assert_allclose(handle, robot.placement(q, "handle")[:3, 3], atol=1e-5)
    for joint, name in enumerate(robot.names):
        found = pin.XYZQUATToSE3(np.array(poses[7 * joint : 7 * joint + 7])).homogeneous
        np.testing.assert_allclose(found, robot.placement(q, name), atol=3e-5)


def test_a_model_shows_its_own_shapes() -> None:
    urdf = read_text("giant.urdf")
    shapes = Geometry(Robot.from_urdf(urdf, "giant"), urdf, [HANDLE]).shapes
    assert len(shapes) == urdf.count("<visual")
    (post,) = (s for s in shapes if np.allclose(s.pose[:3], [-2.35, -2.75, -0.815]))
    assert (post.kind, post.joint) == ("box", 0)
    np.testing.assert_allclose(post.size, [0.12, 0.12, 2.47])


def test_a_skeleton_joins_every_joint_to_the_next() -> None:
    """Ends of its capsules, without a shape in the model: from a joint's origin to that of the next."""
    urdf = read_text("panda.urdf")
    assert "<visual" not in urdf
    robot = Robot.from_urdf(urdf, "panda")
    links = [s for s in Geometry(robot, urdf, [HANDLE]).shapes if s.kind == "capsule"]
    for link in links:
        placement = pin.XYZQUATToSE3(np.array(link.pose))
        half = placement.rotation[:, 2] * link.size[1] / 2
        np.testing.assert_allclose(placement.translation - half, 0.0, atol=2e-5)
        end = placement.translation + half
        children = [robot.model.jointPlacements[j].translation for j in range(1, robot.model.njoints)]
        tips = [*children, robot.model.frames[robot.frame("handle")].placement.translation]
        assert min(float(np.linalg.norm(end - tip)) for tip in tips) < 3e-5
    assert len(links) >= 5


def test_a_grip_of_its_own_axes_is_offset_and_turned_and_so_is_its_wrench() -> None:
    urdf = read_text("panda.urdf")
    robot = Robot.from_urdf(urdf, "panda")
    own = Grip("own", "handle", (0.1, 0.0, 0.2), (0.0, 0.0, np.pi / 2), own_axes=True)
    geometry = Geometry(robot, urdf, [HANDLE, own])
    q = np.random.default_rng(2).uniform(-0.4, 0.4, robot.nv)
    force, torque = np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3])
    wrench = [*force, *torque]
    poses, places, wrenches = geometry.place(q.tolist(), [*wrench, *wrench])
    T = robot.placement(q, "handle")
    np.testing.assert_allclose(places[3:], (T @ [0.1, 0.0, 0.2, 1.0])[:3], atol=1e-5)
    R = T[:3, :3] @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(wrenches, [*wrench, *(R @ force), *(R @ torque)], atol=1e-12)
    for tip, place in zip(geometry.shapes[-2:], (places[:3], places[3:]), strict=True):  # drawn up to there
        joint = pin.XYZQUATToSE3(np.array(poses[7 * (tip.joint - 1) : 7 * tip.joint]))
        assert tip.kind == "sphere"
        np.testing.assert_allclose(joint * np.array(tip.pose[:3]), place, atol=5e-5)


@pytest.mark.parametrize("station", ["operator", "avatar"])
def test_of_a_station_its_own_arms_are_drawn(station: str) -> None:
    session = build(load(station))
    assert session.system.scene is not None
    scene = session.system.scene(session.config)
    robot = drawn(session.robot, scene)
    assert robot.nv == 14 and all(name.startswith(station) for name in robot.names)
    state = np.zeros((), session.cycle.machine.state)
    q = np.random.default_rng(4).uniform(-1.0, 1.0, (2, 7))
    state["q"] = q
    assert np.array_equal(scene.posture(state), q.ravel())
    geometry = Geometry(robot, session.loaded.model_text, scene.grips)
    _, places, wrenches = geometry.place(scene.posture(state), scene.wrench(state))
    assert len(places) == 6 == len(scene.twin(state) or ()) and len(wrenches) == 12
