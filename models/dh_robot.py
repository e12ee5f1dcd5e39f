"""A serial robot from a Denavit-Hartenberg table and the masses of its links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from .dh import DhRow
from .robot import Robot

END = "end"
"""Name of the frame behind the last row."""


@dataclass(frozen=True, slots=True)
class Body:
    """Mass [kg], centre (3,) [m] and principal moments about it (3,) [kg m^2], in the frame behind a row."""

    mass: float = 0.0
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    moments: Sequence[float] = (0.0, 0.0, 0.0)


def from_dh(rows: Sequence[DhRow], bodies: Sequence[Body]) -> Robot:
    """The robot of a table, one body a row; the frame ``END`` is behind the last row."""
    model = pin.Model()
    link = pin.SE3.Identity()
    for parent, (row, body) in enumerate(zip(rows, bodies, strict=True)):
        kind = pin.JointModelRZ() if row.kind == "revolute" else pin.JointModelPZ()
        joint = model.addJoint(parent, kind, link, row.name)
        link = pin.SE3(row.link())
        inertia = pin.Inertia(body.mass, np.array(body.centre, float), np.diag(body.moments))
        model.appendBodyToJoint(joint, inertia, link)
    model.addFrame(pin.Frame(END, len(rows), 0, link, pin.FrameType.OP_FRAME))
    return Robot(model)
