"""The URDF in the repository is what its generator writes, and what a machine needs."""

import numpy as np
import pinocchio as pin
from hapticd.configs import read_text
from hapticd.machines.giant import urdf as giant_urdf
from hapticd.models import Robot


def test_the_stored_urdf_is_the_generated_one() -> None:
    assert read_text("giant.urdf") == giant_urdf.urdf()


def test_inertia_of_joined_parts_is_that_of_the_sum_of_point_masses() -> None:
    parts = giant_urdf.PARTS["link_2"]
    mass, centre, inertia = giant_urdf.inertial(parts)
    rng = np.random.default_rng(3)
    total, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for part in parts:  # Monte Carlo over the volume of every part
        n = 40_000
        if len(part.size) == 2:
            angle, radius = rng.uniform(0, 2 * np.pi, n), part.size[0] * np.sqrt(rng.uniform(0, 1, n))
            local = np.stack(
                [radius * np.cos(angle), radius * np.sin(angle), part.size[1] * rng.uniform(-0.5, 0.5, n)]
            )
        else:
            local = np.array(part.size)[:, None] * rng.uniform(-0.5, 0.5, (3, n))
        points = part.pose[:3, :3] @ local + part.pose[:3, 3:]
        total += part.mass
        first += part.mass * points.mean(axis=1)
        second += part.mass * (points @ points.T) / n
    np.testing.assert_allclose(mass, total)
    np.testing.assert_allclose(centre, first / total, atol=2e-3)
    about_origin = np.trace(second) * np.eye(3) - second
    shift = total * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    np.testing.assert_allclose(inertia, about_origin - shift, atol=2e-2)


def test_every_moving_link_has_a_capsule_and_only_neighbours_touch_in_the_rest_posture() -> None:
    text = read_text("giant.urdf")
    robot = Robot.from_urdf(text, "giant.urdf")
    geometry = pin.buildGeomFromUrdfString(robot.model, text, pin.GeometryType.COLLISION, None)
    assert {type(shape.geometry).__name__ for shape in geometry.geometryObjects} == {"Capsule"}
    geometry.addAllCollisionPairs()
    data = pin.GeometryData(geometry)
    q = robot.configuration(np.array([0, 0, 0, np.pi / 2, -0.67, 0.3, 0.9, 0]))
    pin.computeCollisions(robot.model, robot.data, geometry, data, q, False)
    touching = {
        tuple(geometry.geometryObjects[i].name.removesuffix("_0") for i in (pair.first, pair.second))
        for pair, result in zip(geometry.collisionPairs, data.collisionResults, strict=True)
        if result.isCollision()
    }
    assert touching == {
        ("carriage", "link_1"),
        ("link_1", "link_2"),
        ("link_2", "link_3"),
        ("link_3", "link_4"),
        ("link_4", "link_5"),
        ("link_4", "handle"),  # the wrist is shorter than the capsules are wide
        ("link_5", "handle"),
    }


def test_every_link_that_moves_can_be_seen() -> None:
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf")
    geometry = pin.buildGeomFromUrdfString(
        robot.model, read_text("giant.urdf"), pin.GeometryType.VISUAL, None
    )
    assert {int(shape.parentJoint) for shape in geometry.geometryObjects} == set(range(robot.model.njoints))
