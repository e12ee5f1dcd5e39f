"""A machine's model as simple shapes, and where they are in a posture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin

from ..models import Array, Robot
from ..runtime.core.scene import Grip, MachineScene

BODY, JOINT, TIP = (0.62, 0.66, 0.71), (0.93, 0.50, 0.13), (0.20, 0.45, 0.75)
"""Colours of a machine whose model shows no shapes."""
THICKNESS = 0.02
"""Of its links, as a share of how far it reaches."""


class Shape(msgspec.Struct, frozen=True):
    """A body that moves with a joint.

    Attributes:
        joint: number of the joint that carries it, 0 for the base.
        kind: "box", "cylinder", "sphere" or "capsule".
        size: edges of a box [m]; radius and length of a cylinder, or of a capsule without its ends; radius.
        pose: in the joint's frame: position [m], quaternion (x, y, z, w).
        colour: red, green, blue, 0 to 1.
    """

    joint: int
    kind: str
    size: list[float]
    pose: list[float]
    colour: list[float]


def drawn(robot: Robot, scene: MachineScene) -> Robot:
    """The joints of a model that a scene draws; the others stand where the model has them at zero."""
    others = [name for name in robot.names if not name.startswith(scene.parts)]
    return robot.without(others) if others else robot


class Grips:
    """Where hands hold a machine, and what they do to it there."""

    def __init__(self, robot: Robot, grips: Sequence[Grip]) -> None:
        self._robot = robot
        self._grips = [
            (robot.frame(grip.frame), pin.SE3(pin.exp3(np.array(grip.turned)), np.array(grip.offset)), grip)
            for grip in grips
        ]

    def tips(self) -> list[tuple[int, Array]]:
        """The joint that carries each, and its place in that joint's frame (3,) [m]."""
        frames = [(self._robot.model.frames[frame], inside) for frame, inside, _ in self._grips]
        return [(int(frame.parentJoint), (frame.placement * inside).translation) for frame, inside in frames]

    def place(self, posture: Sequence[float], wrenches: Sequence[float]) -> list[tuple[pin.SE3, Array]]:
        """Pose of each grip, and the wrench there, (6,) [N, N m], both in the base's axes."""
        model, data = self._robot.model, self._robot.data
        pin.forwardKinematics(model, data, self._robot.configuration(np.array(posture, float)))
        found = []
        rows = np.array(wrenches, float).reshape(-1, 2, 3)
        for (frame, inside, grip), wrench in zip(self._grips, rows, strict=True):
            at = pin.updateFramePlacement(model, data, frame) * inside
            found.append((at, (wrench @ at.rotation.T if grip.own_axes else wrench).ravel()))
        return found


class Geometry:
    """Shapes of a model.

    Attributes:
        shapes: all of them.
    """

    def __init__(self, robot: Robot, urdf: str, grips: Sequence[Grip]) -> None:
        """The shapes that the description shows, or else a skeleton of its joints."""
        self._robot, self._grips = robot, Grips(robot, grips)
        self.shapes = _visible(robot, urdf) or _skeleton(robot, self._grips.tips())

    def place(
        self, posture: Sequence[float], wrenches: Sequence[float]
    ) -> tuple[list[float], list[float], list[float]]:
        """Where everything is.

        Returns:
            Poses of the joints from the first on, seven numbers each; places of the grips [m]; the wrenches
            there in the base's axes.
        """
        grips = self._grips.place(posture, wrenches)
        data = self._robot.data
        poses = [value for joint in range(1, self._robot.model.njoints) for value in pose(data.oMi[joint])]
        places = [round(float(v), 5) for at, _ in grips for v in at.translation]
        return poses, places, [float(v) for _, wrench in grips for v in wrench]


def pose(placement: Any) -> list[float]:
    """Position [m] and quaternion (x, y, z, w) of a placement."""
    return [round(float(v), 5) for v in pin.SE3ToXYZQUAT(placement)]


def _visible(robot: Robot, urdf: str) -> list[Shape]:
    geometry = pin.buildGeomFromUrdfString(robot.model, urdf, pin.GeometryType.VISUAL, None)
    return [shape for each in geometry.geometryObjects if (shape := _shape(each))]


def _shape(visual: Any) -> Shape | None:
    """A shape of the description; None for a mesh."""
    form = visual.geometry
    match type(form).__name__:
        case "Box":
            kind, size = "box", [2.0 * float(half) for half in form.halfSide]
        case "Cylinder":
            kind, size = "cylinder", [float(form.radius), 2.0 * float(form.halfLength)]
        case "Capsule":
            kind, size = "capsule", [float(form.radius), 2.0 * float(form.halfLength)]
        case "Sphere":
            kind, size = "sphere", [float(form.radius)]
        case _:
            return None
    colour = [float(c) for c in visual.meshColor[:3]]
    return Shape(int(visual.parentJoint), kind, size, pose(visual.placement), colour)


def _skeleton(robot: Robot, tips: Sequence[tuple[int, Array]]) -> list[Shape]:
    """A capsule from each joint to the next and to the grips, and a drum about each that turns."""
    model = robot.model
    ends = [(model.parents[j], model.jointPlacements[j].translation) for j in range(1, model.njoints)]
    ends += tips
    reach = sum(float(np.linalg.norm(end)) for _, end in ends) / len(tips)  # of each of its arms
    thick = THICKNESS * max(reach, 1e-3)
    shapes = [link for joint, end in ends if (link := _link(int(joint), end, thick))]
    for joint in range(1, model.njoints):
        axis = np.array(pin.computeJointJacobian(model, model.createData(), pin.neutral(model), joint)[3:])
        axis = axis[:, model.joints[joint].idx_v]
        if np.linalg.norm(axis) > 0.5:
            turned = _along(axis / np.linalg.norm(axis), np.zeros(3))
            shapes.append(Shape(joint, "cylinder", [1.3 * thick, 3.0 * thick], pose(turned), list(JOINT)))
    for joint, tip in tips:
        shapes.append(Shape(joint, "sphere", [0.6 * thick], pose(pin.SE3(np.eye(3), tip)), list(TIP)))
    return shapes


def _link(joint: int, end: Array, thick: float) -> Shape | None:
    length = float(np.linalg.norm(end))
    if length < 1e-6:
        return None
    placement = _along(np.asarray(end) / length, 0.5 * np.asarray(end))
    return Shape(joint, "capsule", [thick, length], pose(placement), list(BODY))


def _along(direction: Array, middle: Array) -> Any:
    """A placement whose z axis has a direction."""
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), np.array(direction))
    return pin.SE3(turn.toRotationMatrix(), np.array(middle))
