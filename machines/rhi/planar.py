"""Planar serial chains as URDF, and the two redundant interfaces of ContactAware.

``python -m hapticd.machines.rhi.planar > configs/rhi.urdf`` writes the 4-DoF device.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, pi

import numpy as np

from ...models.dh import Array

HANDLE = "handle"
"""Frame at the end of the last link."""
THICKNESS = 0.008
"""Thickness of a link across its length [m]; a homogeneous square rod."""


@dataclass(frozen=True, slots=True)
class Link:
    """A link that turns about z relative to the one before it and lies along its own x axis.

    Attributes:
        length: [m].
        mass: [kg], its centre half-way.
        rest: angle to the link before it at joint angle 0 [rad].
        lower, upper: of the joint, infinite where it may turn freely [rad].
        velocity: [rad/s].
        effort: [N m].
    """

    length: float
    mass: float
    rest: float = 0.0
    lower: float = -inf
    upper: float = inf
    velocity: float = 30.0
    effort: float = 6.0


LENGTHS = (0.254, 0.141, 0.21, 0.181)  # ContactAware, (20) [m]
FOUR_DOF = (
    Link(LENGTHS[0], 0.020, effort=6.0),
    Link(LENGTHS[1], 0.015, rest=-pi / 2, effort=3.0),
    Link(LENGTHS[2], 0.015, rest=pi / 2, effort=2.0),
    Link(LENGTHS[3], 0.010, rest=-pi / 2, effort=1.0),
)
"""The planar device of ContactAware, IV: two 2-DoF interfaces in series. The masses are estimates; with the
inertias of the motors in configs/rhi.toml they give the apparent masses of Table I. The efforts are what the
motors' torques of section IV amount to at the joints."""
FOUR_DOF_TRANSMISSION: Array = np.array(
    [[1.0, 0.0, 0.0, 0.0], [-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, -1.0, 1.0]]
)
"""Joint angles from motor angles: in (20) q1 and q2 are absolute, q3 and q4 both relative to link 2."""
THREE_DOF = tuple(Link(0.25, 0.5, effort=0.5) for _ in range(3))
"""The example of ContactAware, III-A, figs 3 and 4."""


def urdf(name: str, links: Sequence[Link]) -> str:
    """A planar chain in the x-y plane of its base, z up, with the frame HANDLE at its end."""
    robot = ET.Element("robot", name=name)
    ET.SubElement(robot, "link", name="base")
    before, reach = "base", 0.0
    for i, link in enumerate(links, 1):
        _body(robot, f"link_{i}", link)
        continuous = link.upper == inf
        kind = "continuous" if continuous else "revolute"
        joint = _joint(robot, f"joint_{i}", kind, (before, f"link_{i}"), reach, link.rest)
        ET.SubElement(joint, "axis", xyz="0 0 1")
        limit = {"effort": f"{link.effort:g}", "velocity": f"{link.velocity:g}"}
        if not continuous:
            limit |= {"lower": repr(link.lower), "upper": repr(link.upper)}
        ET.SubElement(joint, "limit", limit)
        ET.SubElement(joint, "dynamics", damping="0")  # friction is that of the motors
        before, reach = f"link_{i}", link.length
    ET.SubElement(robot, "link", name=HANDLE)
    _joint(robot, "handle_mount", "fixed", (before, HANDLE), reach, 0.0)
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _body(robot: ET.Element, name: str, link: Link) -> None:
    body = ET.SubElement(ET.SubElement(robot, "link", name=name), "inertial")
    ET.SubElement(body, "origin", xyz=f"{link.length / 2!r} 0 0", rpy="0 0 0")
    ET.SubElement(body, "mass", value=repr(link.mass))
    along = link.mass * THICKNESS**2 / 6.0
    across = link.mass * (link.length**2 + THICKNESS**2) / 12.0
    moments = {"ixx": along, "ixy": 0.0, "ixz": 0.0, "iyy": across, "iyz": 0.0, "izz": across}
    ET.SubElement(body, "inertia", {key: repr(value) for key, value in moments.items()})


def _joint(
    robot: ET.Element, name: str, kind: str, ends: tuple[str, str], reach: float, rest: float
) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(joint, "origin", xyz=f"{reach!r} 0 0", rpy=f"0 0 {rest!r}")
    ET.SubElement(joint, "parent", link=ends[0])
    ET.SubElement(joint, "child", link=ends[1])
    return joint


if __name__ == "__main__":
    sys.stdout.write(urdf("rhi", FOUR_DOF))
