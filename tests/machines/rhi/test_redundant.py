"""Kinematics, derivatives and inertia in motor coordinates against ContactAware, pinocchio, differences."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.machines.rhi import planar
from hapticd.machines.rhi.redundant import AXES, RedundantArm
from hapticd.models import ModelError, Robot

from ...control.test_serial import random_arm
from .rhi_device import ROTOR, four_dof, printed_jacobian, printed_position


def test_the_device_moves_as_printed() -> None:
    arm = four_dof()
    for q in np.random.default_rng(1).uniform(-np.pi, np.pi, (200, 4)):
        arm.at(q)
        np.testing.assert_allclose(arm.position, printed_position(q), atol=1e-14)
        np.testing.assert_allclose(arm.J, printed_jacobian(q), atol=1e-14)


SPATIAL = random_arm(5)
SPATIAL_ROTOR = np.linspace(0.1, 0.6, SPATIAL.nv)


def spatial() -> RedundantArm:
    """Joints about and along all axes, three directions, a transmission that mixes them."""
    n = SPATIAL.nv
    T = np.eye(n) + 0.3 * np.random.default_rng(4).standard_normal((n, n))
    return RedundantArm(SPATIAL, "tip", ("z", "x", "y"), T, SPATIAL_ROTOR)


@pytest.mark.parametrize("make", [four_dof, spatial])
def test_derivatives_are_those_of_central_differences(make: type[RedundantArm]) -> None:
    arm = make()
    h = 1e-6
    for q in np.random.default_rng(2).uniform(-1.5, 1.5, (50, arm.n)):
        J, dJ = arm.at(q).J.copy(), arm.dJ.copy()
        for k, step in enumerate(h * np.eye(arm.n)):
            above, below = arm.at(q + step).J.copy(), arm.at(q - step).J.copy()
            np.testing.assert_allclose(dJ[k], (above - below) / (2 * h), atol=1e-7 * np.abs(dJ).max())
            there, back = arm.at(q + step).position.copy(), arm.at(q - step).position.copy()
            np.testing.assert_allclose(J[:, k], (there - back) / (2 * h), atol=1e-8 * np.abs(J).max())


@pytest.mark.parametrize("make", [four_dof, spatial])
def test_inertia_is_that_of_pinocchio_seen_from_the_motors(make: type[RedundantArm]) -> None:
    arm = make()
    model = (
        Robot.from_urdf(planar.urdf("rhi", planar.FOUR_DOF), "rhi.urdf").model
        if arm.n == 4
        else SPATIAL.model
    )
    rotor = ROTOR if arm.n == 4 else SPATIAL_ROTOR
    T, data = arm.transmission, model.createData()
    for q in np.random.default_rng(3).uniform(-1.5, 1.5, (50, arm.n)):
        r = pin.neutral(model)
        joints = T @ q
        if model.nq == arm.n:
            r[:] = joints
        else:  # continuous joints are (cos, sin)
            r[0::2], r[1::2] = np.cos(joints), np.sin(joints)
        upper = np.triu(pin.crba(model, data, r))
        M = upper + np.triu(upper, 1).T
        np.testing.assert_allclose(arm.at(q).M, T.T @ M @ T + np.diag(rotor), atol=1e-12 * np.abs(M).max())


def test_the_hand_moves_with_its_jacobian() -> None:
    arm = four_dof()
    arm.q[:], arm.qd[:] = (0.3, 1.1, -0.4, 0.9), (1.0, -2.0, 0.5, 3.0)
    arm.update()
    np.testing.assert_allclose(arm.velocity, printed_jacobian(arm.q) @ arm.qd, atol=1e-14)


def test_a_sweep_is_the_same_as_one_at_a_time() -> None:
    arm = four_dof()
    Q = np.random.default_rng(6).uniform(-2, 2, (7, 4))
    x, J, dJ = arm.sweep(Q)
    for i, q in enumerate(Q):
        arm.at(q)
        assert (x[i] == arm.position).all() and (J[i] == arm.J).all() and (dJ[i] == arm.dJ).all()


@pytest.mark.parametrize(
    ("task", "T", "rotor", "message"),
    [
        (AXES, np.eye(3), np.zeros(3), "at least as many joints"),
        (("x", "x"), np.eye(3), np.zeros(3), "once each"),
        (("x", "w"), np.eye(3), np.zeros(3), "once each"),
        (("x",), np.ones((3, 3)), np.zeros(3), "independent rows"),
        (("x",), np.eye(2), np.zeros(3), "independent rows"),
        (("x",), np.eye(3), np.zeros(2), "give 3"),
    ],
)
def test_what_is_no_redundant_interface_is_refused(
    task: tuple[str, ...], T: np.ndarray, rotor: np.ndarray, message: str
) -> None:
    robot = Robot.from_urdf(planar.urdf("example", planar.THREE_DOF), "example.urdf")
    with pytest.raises(ModelError, match=message):
        RedundantArm(robot, planar.HANDLE, task, T, rotor)
