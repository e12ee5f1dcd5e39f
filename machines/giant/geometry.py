"""Whether a model is the giant, whose controller takes lengths from Table I, and has its handle."""

from __future__ import annotations

import numpy as np

from ...models import Robot
from ...models.dh import forward
from .kinematics import DH, T_BASE_DH
from .names import JOINTS, PPU_JOINTS

NEAR = 1e-3
"""How far places [m] and directions may be from Table I."""
ELBOW_ROW = 4
"""Row of Table I at whose end joint 4 sits."""
PLACES = {
    "handle": JOINTS[-1],
    "force_torque": JOINTS[-1],
    "imu_handle": JOINTS[-1],
    "imu_carriage": PPU_JOINTS[-1],
}
"""Frames that the controller and the plant need, and the joint that carries each."""


def check_geometry(robot: Robot) -> list[tuple[str, str]]:
    """What makes a robot another machine than the giant: problem, fix."""
    names = [row.name for row in DH]
    if robot.names != names:
        missing = [name for name in names if name not in robot.names]
        what = f"lacks {', '.join(missing)}" if missing else f"has the joints {', '.join(robot.names[:20])}"
        return [(f"the model {what}", f"the giant's joints are {', '.join(names)}")]
    for name, carrier in PLACES.items():
        if not robot.model.existFrame(name):
            return [(f"the model lacks the frame '{name}'", f"fix one to what {carrier} moves")]
        frame = robot.model.frames[robot.frame(name)]
        if robot.model.names[frame.parentJoint] != carrier:
            return [(f"frame '{name}' is carried by another joint", f"fix it to what {carrier} moves")]
    if np.abs(robot.placement(np.zeros(robot.nv), "imu_carriage")[:3, :3] - np.eye(3)).max() > NEAR:
        return [("frame 'imu_carriage' is turned", "its axes are those of the base")]
    for q in (np.linspace(0.1, 0.8, robot.nv), np.linspace(0.7, -0.4, robot.nv)):
        poses = forward(T_BASE_DH, DH, q)
        handle = np.abs(robot.placement(q, "handle") - poses[-1]).max()
        elbow = np.abs(robot.placement(q, JOINTS[3])[:3, 3] - poses[ELBOW_ROW][:3, 3]).max()
        if max(handle, elbow) > NEAR:
            problem = f"handle or joint_4 is {max(handle, elbow):.3g} m away from where Table I puts it"
            return [(problem, "the controller knows no other lengths: use the giant's URDF")]
    return []
