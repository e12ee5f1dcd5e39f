"""Table I and its closed-form inverse against the URDF in pinocchio."""

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.machines.giant.kinematics import DH, T_BASE_DH, Branch, UnreachableError, inverse_kinematics
from hapticd.models import Robot
from hapticd.models.dh import forward, rot_z, translation

LOWER = np.array([-1.6, -1.9, -np.pi, 0.45, -2.2, -0.6, -0.9, -1.2])
UPPER = np.array([1.6, 1.9, np.pi, 2.4, 1.2, 1.15, 2.2, 1.2])


@pytest.fixture(scope="module")
def robot() -> Robot:
    return Robot.from_urdf(read_text("giant.urdf"), "giant.urdf")


def postures(count: int) -> np.ndarray:
    rng = np.random.default_rng(7)
    q = rng.uniform(LOWER, UPPER, (count, 8))
    q[:, 6] = rng.uniform(0.05, np.pi - 0.05, count) - q[:, 5]  # any tilt that is no singularity
    return q


def test_the_urdf_has_the_kinematics_of_table_1(robot: Robot) -> None:
    for q in postures(200):
        handle = forward(T_BASE_DH, DH, q)[-1]
        np.testing.assert_allclose(robot.placement(q, "handle"), handle, atol=1e-12)


def test_inverse_kinematics_inverts_forward_kinematics_over_the_workspace() -> None:
    for q in postures(2000):
        T = forward(T_BASE_DH, DH, q)[-1]
        found = inverse_kinematics(T, q[:2], Branch(raised=q[5] > 0, elbow_left=q[3] > 0))
        difference = (found - q[2:] + np.pi) % (2 * np.pi) - np.pi
        np.testing.assert_allclose(difference, 0.0, atol=1e-7)


@pytest.mark.parametrize("raised", [True, False])
@pytest.mark.parametrize("elbow_left", [True, False])
def test_every_branch_reaches_the_same_pose(raised: bool, elbow_left: bool) -> None:
    reached = 0
    for q in postures(200):
        T = forward(T_BASE_DH, DH, q)[-1]
        try:
            found = inverse_kinematics(T, q[:2], Branch(raised, elbow_left))
        except UnreachableError:  # the forearm on the other side puts the elbow too far away
            continue
        again = forward(T_BASE_DH, DH, np.concatenate([q[:2], found]))[-1]
        np.testing.assert_allclose(again, T, atol=1e-9)
        reached += 1
    assert reached >= 100


def test_redundancy_is_resolved_by_the_position_of_the_ppu() -> None:
    q = postures(1)[0]
    T = forward(T_BASE_DH, DH, q)[-1]
    elsewhere = q[:2] + np.array([0.1, -0.05])
    found = inverse_kinematics(T, elsewhere, Branch(raised=q[5] > 0))
    np.testing.assert_allclose(forward(T_BASE_DH, DH, np.concatenate([elsewhere, found]))[-1], T, atol=1e-12)


def test_a_pose_that_is_too_high_or_too_far_is_unreachable() -> None:
    T = translation(0.8, 0.0, 0.5)
    with pytest.raises(UnreachableError, match=r"height 0\.500 m"):
        inverse_kinematics(T, np.zeros(2), Branch())
    q = postures(1)[0]
    T = translation(5.0) @ forward(T_BASE_DH, DH, q)[-1]
    with pytest.raises(UnreachableError, match="from the PPU"):
        inverse_kinematics(T, np.zeros(2), Branch())


def test_axes_point_where_the_paper_says() -> None:
    home = np.zeros(8)
    ppu = forward(T_BASE_DH, DH, home + np.eye(8)[0])[1] @ np.linalg.inv(forward(T_BASE_DH, DH, home)[1])
    np.testing.assert_allclose(ppu, translation(1.0), atol=1e-12)
    turned = forward(T_BASE_DH, DH, 0.3 * np.eye(8)[2])[-1]
    np.testing.assert_allclose(turned, rot_z(0.3) @ forward(T_BASE_DH, DH, home)[-1], atol=1e-12)
    heights = [
        forward(T_BASE_DH, DH, angle * np.eye(8)[5] - angle * np.eye(8)[6])[-1][2, 3] for angle in (0.1, 0.4)
    ]
    assert heights[1] > heights[0]  # raising q4 raises the handle
    np.testing.assert_allclose(forward(T_BASE_DH, DH, home)[-1][:3, 2], [0, 0, -1], atol=1e-12)


def test_the_links_add_up_to_the_length_and_the_moving_mass_of_the_paper(robot: Robot) -> None:
    assert sum(abs(row.a) + abs(row.d) for row in DH) == pytest.approx(2.49)
    moving = [robot.model.inertias[i].mass for i in range(3, robot.model.njoints)]
    assert sum(moving) == pytest.approx(36.8, abs=1e-9)
