"""The planar devices: the stored URDF is the generated one, and it is what ContactAware prints."""

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.machines.rhi import planar
from hapticd.models import Robot


def test_the_stored_urdf_is_the_generated_one() -> None:
    assert read_text("rhi.urdf") == planar.urdf("rhi", planar.FOUR_DOF)


@pytest.mark.parametrize("links", [planar.FOUR_DOF, planar.THREE_DOF])
def test_links_lie_one_behind_the_other(links: tuple[planar.Link, ...]) -> None:
    robot = Robot.from_urdf(planar.urdf("chain", links), "chain.urdf")
    q = np.random.default_rng(1).uniform(-1.0, 1.0, robot.nv)
    angles = np.cumsum(q + [link.rest for link in links])
    ends = [link.length for link in links] * np.array([np.cos(angles), np.sin(angles)])
    T = robot.placement(q, planar.HANDLE)
    np.testing.assert_allclose(T[:3, 3], [*ends.sum(axis=1), 0.0], atol=1e-12)
    assert robot.model.inertias[1].mass == links[0].mass


def test_joints_with_limits_keep_them() -> None:
    text = planar.urdf("stop", [planar.Link(0.3, 0.1, lower=-0.5, upper=0.7)])
    robot = Robot.from_urdf(text, "stop.urdf")
    assert (robot.lower[0], robot.upper[0]) == (-0.5, 0.7)
    assert np.isinf(Robot.from_urdf(planar.urdf("free", planar.FOUR_DOF), "free.urdf").upper).all()
