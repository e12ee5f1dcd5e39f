"""The constants of a serial robot as the C core wants them (csrc/serial_model.h), from pinocchio's model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from .errors import ModelError
from .robot import Robot


def joints(robot: Robot, most: int) -> list[dict[str, Any]]:
    """Fields of a ``serial_joint`` for each joint of a robot, of which there may be so many.

    Raises:
        ModelError: it is no serial chain, or has other joints or too many.
    """
    model, n = robot.model, robot.nv
    if n > most:
        raise ModelError(model.name, 0, f"{n} joints", f"at most {most} are supported")
    found = []
    for i in range(1, n + 1):
        prismatic, axis = _axis(model.name, model.names[i], model.joints[i])
        if model.parents[i] != i - 1:
            raise ModelError(model.name, 0, f"'{model.names[i]}' branches off", "a serial chain is needed")
        body = model.inertias[i]
        found.append(
            {
                **_pose(model.jointPlacements[i]),
                **{"axis": axis, "prismatic": prismatic, "mass": body.mass, "centre": body.lever.tolist()},
                "inertia": np.asarray(body.inertia).reshape(-1).tolist(),
            }
        )
    return found


def frame(robot: Robot, name: str) -> dict[str, Any]:
    """The joint that carries a frame, and its pose in that joint's.

    Raises:
        ModelError: there is none of that name.
    """
    own = robot.model.frames[robot.frame(name)]
    return {"joint": int(own.parentJoint) - 1, **_pose(own.placement)}


def _axis(robot: str, name: str, joint: pin.JointModel) -> tuple[bool, list[float]]:
    """Whether a joint slides, and its axis in its own frame (3,)."""
    if joint.nv != 1:
        kind = joint.shortname().removeprefix("JointModel")
        raise ModelError(robot, 0, f"joint '{name}' is a {kind}", "use joints that turn or slide")
    data = joint.createData()
    joint.calc(data, pin.neutral(_alone(joint)))
    linear, angular = np.asarray(data.S).reshape(2, 3)
    return bool(linear.any()), (linear if linear.any() else angular).tolist()


def _alone(joint: pin.JointModel) -> pin.Model:
    """A model of one joint, whose neutral configuration is the joint's."""
    model = pin.Model()
    model.addJoint(0, joint, pin.SE3.Identity(), "joint")
    return model


def _pose(placement: Any) -> dict[str, list[float]]:
    return {"R": placement.rotation.reshape(-1).tolist(), "t": placement.translation.tolist()}
