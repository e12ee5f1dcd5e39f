"""A serial arm as a URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from math import inf

from ...models import Array
from .description import Description, Joint


def write_urdf(arm: Description) -> str:
    """The arm as a URDF that holds what is needed, and nothing else."""
    robot = ET.Element("robot", name=arm.name)
    for name, body in arm.links.items():
        link = ET.SubElement(robot, "link", name=name)
        if body is not None:
            inertial = ET.SubElement(link, "inertial")
            ET.SubElement(inertial, "origin", xyz=_text(body.centre), rpy="0 0 0")
            ET.SubElement(inertial, "mass", value=repr(float(body.mass)))
            entries = {
                "ixx": (0, 0),
                "ixy": (0, 1),
                "ixz": (0, 2),
                "iyy": (1, 1),
                "iyz": (1, 2),
                "izz": (2, 2),
            }
            ET.SubElement(
                inertial, "inertia", {key: repr(float(body.inertia[at])) for key, at in entries.items()}
            )
        for shape in arm.shapes.get(name, ()):
            collision = ET.SubElement(link, "collision")
            ET.SubElement(collision, "origin", xyz=_text(shape.xyz), rpy=_text(shape.rpy))
            sizes = {key: _text(values) for key, values in shape.numbers.items()}
            ET.SubElement(ET.SubElement(collision, "geometry"), shape.kind, sizes)
    for joint in (*arm.joints.values(), *arm.frozen):
        _write_joint(robot, joint)
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _write_joint(robot: ET.Element, joint: Joint) -> None:
    kind = "continuous" if joint.kind == "revolute" and joint.upper == inf else joint.kind
    element = ET.SubElement(robot, "joint", name=joint.name, type=kind)
    ET.SubElement(element, "origin", xyz=_text(joint.xyz), rpy=_text(joint.rpy))
    ET.SubElement(element, "parent", link=joint.parent)
    ET.SubElement(element, "child", link=joint.child)
    if kind == "fixed":
        return
    ET.SubElement(element, "axis", xyz=_text(joint.axis))
    limit = {"effort": repr(joint.effort), "velocity": repr(joint.velocity)}
    if kind != "continuous":
        limit |= {"lower": repr(joint.lower), "upper": repr(joint.upper)}
    ET.SubElement(element, "limit", limit)
    ET.SubElement(element, "dynamics", damping=repr(joint.damping))


def _text(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value)) for value in values)
