"""Denavit-Hartenberg rows (classic convention: rotate and move along z, then along and about x)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DhRow:
    """One joint: ``T = Rz(theta) Tz(d) Tx(a) Rx(alpha)``; the joint adds to theta or to d.

    Attributes:
        name: of the joint.
        kind: which of theta [rad] and d [m] the joint variable adds to.
        theta: offset angle [rad].
        d: offset along z [m].
        a: length along the new x [m].
        alpha: twist about the new x [rad].
    """

    name: str
    kind: Literal["revolute", "prismatic"]
    theta: float
    d: float
    a: float
    alpha: float

    def joint(self, q: float) -> Array:
        """Transform of the joint's motion alone, (4, 4)."""
        return rot_z(q) if self.kind == "revolute" else translation(0.0, 0.0, q)

    def link(self) -> Array:
        """Constant transform that follows the joint's motion, (4, 4).

        Rz and Tz commute, so both offsets may stand behind the joint.
        """
        return rot_z(self.theta) @ translation(0.0, 0.0, self.d) @ translation(self.a) @ rot_x(self.alpha)


def translation(x: float, y: float = 0.0, z: float = 0.0) -> Array:
    """Homogeneous translation [m], (4, 4)."""
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def rot_x(angle: float) -> Array:
    """Homogeneous rotation about x [rad], (4, 4)."""
    return _rotation(angle, 1, 2)


def rot_y(angle: float) -> Array:
    """Homogeneous rotation about y [rad], (4, 4)."""
    return _rotation(angle, 2, 0)


def rot_z(angle: float) -> Array:
    """Homogeneous rotation about z [rad], (4, 4)."""
    return _rotation(angle, 0, 1)


def _rotation(angle: float, i: int, j: int) -> Array:
    T = np.eye(4)
    c, s = np.cos(angle), np.sin(angle)
    T[i, i] = T[j, j] = c
    T[i, j], T[j, i] = -s, s
    return T


def forward(base: Array, rows: tuple[DhRow, ...], q: Array) -> list[Array]:
    """Pose after each row in the frame that ``base`` (4, 4) is given in; q is (len(rows),)."""
    poses = []
    T = base
    for row, value in zip(rows, q, strict=True):
        T = T @ row.joint(float(value)) @ row.link()
        poses.append(T)
    return poses
