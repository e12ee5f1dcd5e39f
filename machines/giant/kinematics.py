"""Geometry of the giant: Table I of HapticGiant and its closed-form inverse kinematics.

The gantry (PPU) moves along x and y of the base frame B, whose z axis points up. Joints 1 to 3 turn about
z, joint 4 raises the forearm, joint 5 tilts the handle, joint 6 turns it about its own axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, atan2, cos, hypot, pi, sin

import numpy as np

from ...models.dh import Array, DhRow

UPPER, LOWER, DROP, FOREARM, HANDLE = 0.53, 0.67, 0.75, 0.42, 0.12  # Table I [m]

DH = (
    DhRow("ppu_x", "prismatic", 0.0, 0.0, 0.0, pi / 2),
    DhRow("ppu_y", "prismatic", pi / 2, 0.0, 0.0, pi / 2),
    DhRow("joint_1", "revolute", 0.0, 0.0, UPPER, 0.0),
    DhRow("joint_2", "revolute", 0.0, 0.0, LOWER, 0.0),
    DhRow("joint_3", "revolute", pi, -DROP, 0.0, pi / 2),
    DhRow("joint_4", "revolute", -pi / 2, 0.0, FOREARM, 0.0),
    DhRow("joint_5", "revolute", pi / 2, 0.0, 0.0, pi / 2),
    DhRow("joint_6", "revolute", 0.0, HANDLE, 0.0, 0.0),
)
"""Table I, the rows of the PPU and of the manipulator."""

T_BASE_DH = np.array(
    [
        [0.0, 0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
"""Frame of the first DH row in B: Table I needs it for the PPU to move along x and y of B."""


class UnreachableError(ValueError):
    """No joint angles reach the pose; ``reason`` says which part of the chain is too short."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"the pose is out of reach: {reason}")


@dataclass(frozen=True, slots=True)
class Branch:
    """Which of the four solutions: sign of q4 and sign of q2 (the SCARA's elbow)."""

    raised: bool = True
    elbow_left: bool = True


def inverse_kinematics(T_base_handle: Array, q_ppu: Array, branch: Branch) -> Array:
    """Manipulator angles (6,) [rad] that bring the handle to a pose (HapticGiant, section IV-A).

    The orientation as zyz-Euler angles gives the yaw q1 + q2 + q3, the tilt q4 + q5 and q6; the height
    gives q4; with the PPU position as the redundancy parameter the rest is a SCARA arm.

    Args:
        T_base_handle: pose of the handle in B, (4, 4) [m]. The tilt q4 + q5 must lie in (0, pi).
        q_ppu: position of the PPU, (2,) [m].
        branch: which solution.

    Raises:
        UnreachableError: where the height or the distance to the PPU is out of reach.
    """
    R, p = T_base_handle[:3, :3], T_base_handle[:3, 3]
    yaw = atan2(-R[1, 2], -R[0, 2])
    tilt = atan2(hypot(R[0, 2], R[1, 2]), -R[2, 2])
    q6 = atan2(-R[2, 1], R[2, 0])

    cos_q4 = (-p[2] - DROP - HANDLE * cos(tilt)) / FOREARM
    if abs(cos_q4) > 1.0:
        raise UnreachableError(f"height {p[2]:.3f} m with a tilt of {tilt:.3f} rad")
    q4 = acos(cos_q4) if branch.raised else -acos(cos_q4)

    reach = FOREARM * sin(q4) + HANDLE * sin(tilt)
    x = p[0] + reach * cos(yaw) - q_ppu[0]
    y = p[1] + reach * sin(yaw) - q_ppu[1]
    cos_q2 = (x * x + y * y - UPPER**2 - LOWER**2) / (2.0 * UPPER * LOWER)
    if abs(cos_q2) > 1.0:
        raise UnreachableError(f"elbow {hypot(x, y):.3f} m from the PPU")
    q2 = acos(cos_q2) if branch.elbow_left else -acos(cos_q2)
    q1 = atan2(y, x) - atan2(LOWER * sin(q2), UPPER + LOWER * cos_q2)
    return np.array([q1, q2, yaw - q1 - q2, q4, tilt - q4, q6])


def points(q: Sequence[float], q_ppu: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Handle and elbow (origin of joint 4) in B [m] for manipulator angles and PPU position."""
    q12 = q[0] + q[1]
    yaw, tilt = q12 + q[2], q[3] + q[4]
    x = q_ppu[0] + UPPER * cos(q[0]) + LOWER * cos(q12)
    y = q_ppu[1] + UPPER * sin(q[0]) + LOWER * sin(q12)
    reach = FOREARM * sin(q[3]) + HANDLE * sin(tilt)
    z = -DROP - FOREARM * cos(q[3]) - HANDLE * cos(tilt)
    return (x - reach * cos(yaw), y - reach * sin(yaw), z), (x, y, -DROP)
