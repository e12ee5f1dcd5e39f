"""Collision shapes of a robot's links: the primitives of its URDF, in the frames of its joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from .dh import Array
from .findings import Findings
from .grammar import ROBOT
from .reader import read
from .xml_tree import Element, parse

Kind = Literal["box", "cylinder", "capsule", "sphere", "mesh"]
KINDS: tuple[Kind, ...] = ("box", "cylinder", "capsule", "sphere", "mesh")


@dataclass(frozen=True, slots=True)
class Shape:
    """A shape on a link.

    Attributes:
        link: its name.
        kind: of the shape; a cylinder under ``collision_checking`` is a capsule.
        size: sides of a box, radius and length of a cylinder, of a capsule without its caps, radius of a
            sphere; nothing of a mesh [m].
        joint: that carries the link, in the order of the robot's; -1 where it stands.
        T: pose in that joint's frame, in the base's where it stands, (4, 4) [m].
    """

    link: str
    kind: Kind
    size: tuple[float, ...]
    joint: int
    T: Array


def shapes(model: pin.Model, text: str, source: str) -> list[Shape]:
    """Collision shapes of all links of a model, in the order of its URDF.

    Raises:
        ModelError: the URDF is refused.
    """
    root, found = parse(text, source), Findings(source)
    read(root, ROBOT, found)
    found.require_none()
    return [_shape(model, link, element) for link in root.all("link") for element in link.all("collision")]


def _shape(model: pin.Model, link: Element, element: Element) -> Shape:
    name, geometry = link.attributes["name"], element.need("geometry")
    kind = next(kind for kind in KINDS if geometry.child(kind))
    numbers = geometry.need(kind).numbers
    keys = {"box": ("size",), "sphere": ("radius",), "mesh": ()}.get(kind, ("radius", "length"))
    checking = link.child("collision_checking")
    if checking and element.attributes.get("name") in {c.attributes["name"] for c in checking.children}:
        kind = "capsule"
    origin = element.need("origin").numbers
    xyz, rpy = origin["xyz"], origin["rpy"]
    own = pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(xyz))
    frame = model.frames[model.getFrameId(name)]
    size = tuple(value for key in keys for value in numbers[key])
    return Shape(name, kind, size, int(frame.parentJoint) - 1, (frame.placement * own).homogeneous)
