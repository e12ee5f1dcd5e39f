"""The two interfaces of ContactAware, and its equation (20) written down once more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from hapticd.machines.rhi import planar
from hapticd.machines.rhi.environment import Body, Environment
from hapticd.machines.rhi.manipulability import Shape, force_ellipsoid
from hapticd.machines.rhi.redundant import RedundantArm
from hapticd.machines.rhi.shapes import Plane
from hapticd.machines.rhi.tissue import Tissue
from hapticd.models import Array, Robot

LIMIT = np.array([3.0, 3.0, 1.0, 1.0])
ROTOR = np.array([0.0132, 0.0181, 0.0025, 0.0035])
U = np.array([0.0, 1.0])
MU = 5.0
X0 = np.array([0.5, 0.1])


def four_dof() -> RedundantArm:
    robot = Robot.from_urdf(planar.urdf("rhi", planar.FOUR_DOF), "rhi.urdf")
    return RedundantArm(robot, planar.HANDLE, ("x", "y"), planar.FOUR_DOF_TRANSMISSION, ROTOR)


def three_dof() -> RedundantArm:
    robot = Robot.from_urdf(planar.urdf("example", planar.THREE_DOF), "example.urdf")
    return RedundantArm(robot, planar.HANDLE, ("x", "y"), np.eye(3), np.zeros(3))


def home_shape(arm: RedundantArm, limit: Array = LIMIT) -> Shape:
    return Shape.of_home(force_ellipsoid(arm.at(np.zeros(arm.n)).J, limit), MU)


def wall(point: Sequence[float], normal: Sequence[float], stiffness: float) -> Environment:
    return Environment([Body(Plane(point, normal), Tissue(stiffness))])


NARROW = 0.01
"""Of csrc/nullspace.c: part of the trace of J M^-1 J^T below which an eigenvalue is raised."""


def mobility(arm: RedundantArm) -> Array:
    """J M^-1 J^T, (m, m)."""
    S: Array = arm.J @ np.linalg.solve(arm.M, arm.J.T)
    return S


def narrow(arm: RedundantArm) -> bool:
    """Whether motors can hardly move the hand in some direction."""
    S = mobility(arm)
    return bool(np.linalg.eigvalsh(S)[0] < NARROW * np.trace(S))


def raised_projection(arm: RedundantArm) -> Array:
    """I - J^T S^-1 J M^-1, (n, n), with the small eigenvalues of S = J M^-1 J^T raised."""
    S = mobility(arm)
    least = NARROW * np.trace(S)
    e, V = np.linalg.eigh(S)
    e = np.where(e < least, (e**2 + least**2) / (2.0 * least), e)
    N: Array = np.eye(arm.n) - arm.J.T @ (V / e) @ V.T @ arm.J @ np.linalg.inv(arm.M)
    return N


def printed_position(q: Array) -> Array:
    d = planar.LENGTHS
    c, s = np.cos, np.sin
    x = d[0] * c(q[0]) + d[1] * s(q[1]) + d[2] * c(q[1] + q[2]) + d[3] * s(q[1] + q[3])
    y = d[0] * s(q[0]) - d[1] * c(q[1]) + d[2] * s(q[1] + q[2]) - d[3] * c(q[1] + q[3])
    return np.array([x, y])


def printed_jacobian(q: Array) -> Array:
    d1, d2, d3, d4 = planar.LENGTHS
    c, s = np.cos, np.sin
    s23, c23, s24, c24 = s(q[1] + q[2]), c(q[1] + q[2]), s(q[1] + q[3]), c(q[1] + q[3])
    return np.array(
        [
            [-d1 * s(q[0]), d2 * c(q[1]) - d3 * s23 + d4 * c24, -d3 * s23, d4 * c24],
            [d1 * c(q[0]), d2 * s(q[1]) + d3 * c23 + d4 * s24, d3 * c23, d4 * s24],
        ]
    )
