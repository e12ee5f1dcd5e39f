"""Writes the giant's URDF: ``python -m hapticd.machines.giant.urdf > configs/giant.urdf``.

Kinematics are Table I of HapticGiant. The paper gives one figure of the dynamics, a moving mass of 36.8 kg
without the slip ring's rotor; its distribution over the parts, and all shapes, are estimates that add up
to it. Limits are those of the simulated machine; the paper prints none.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, pi

import numpy as np

from ...models.dh import Array, rot_x, rot_y, translation
from . import kinematics as giant

COLOURS = {
    "steel": (0.62, 0.64, 0.67),
    "carbon": (0.16, 0.17, 0.19),
    "aluminium": (0.80, 0.81, 0.83),
    "drive": (0.93, 0.50, 0.13),
    "grip": (0.10, 0.10, 0.11),
    "sensor": (0.20, 0.45, 0.75),
}


@dataclass(frozen=True, slots=True)
class Part:
    """A homogeneous box (x, y, z) or cylinder (radius, length along z) [m] of some mass [kg]."""

    name: str
    size: tuple[float, ...]
    pose: Array
    mass: float
    colour: str

    def inertia(self) -> Array:
        """Moments about its own centre and axes, (3,) [kg m^2]."""
        if len(self.size) == 2:
            r, h = self.size
            across = (3.0 * r * r + h * h) / 12.0
            return self.mass * np.array([across, across, r * r / 2.0])
        squares = np.square(self.size)
        moments: Array = self.mass / 12.0 * (squares.sum() - squares)
        return moments


@dataclass(frozen=True, slots=True)
class Capsule:
    """Collision shape: radius and length of the cylinder along z [m]."""

    radius: float
    length: float
    pose: Array


@dataclass(frozen=True, slots=True)
class Joint:
    """Limits of a joint in the order of Table I: position, velocity, effort, viscous damping (SI)."""

    lower: float
    upper: float
    velocity: float
    effort: float
    damping: float


JOINTS = {
    "ppu_x": Joint(-1.6, 1.6, 2.0, 3000.0, 0.0),
    "ppu_y": Joint(-1.9, 1.9, 2.0, 3000.0, 0.0),
    "joint_1": Joint(-inf, inf, 2.5, 260.0, 3.0),
    "joint_2": Joint(0.45, 2.4, 2.5, 260.0, 3.0),
    "joint_3": Joint(-2.2, 1.2, 3.0, 110.0, 1.5),
    "joint_4": Joint(-0.6, 1.15, 3.0, 110.0, 1.5),
    "joint_5": Joint(-0.9, 2.2, 4.0, 40.0, 0.4),
    "joint_6": Joint(-1.2, 1.2, 5.0, 40.0, 0.25),
}

X = rot_y(pi / 2)  # turns a cylinder's axis onto x
Y = rot_x(-pi / 2)  # onto y
# the frames of bridge and carriage lie on their side; their parts are given in the axes of B
BRIDGE = giant.T_BASE_DH.T
CARRIAGE = (giant.T_BASE_DH @ rot_x(pi / 2)).T


def _frame_parts() -> list[Part]:
    """The portal, 4.7 m x 5.5 m, standing on the floor 2.05 m below the base frame."""
    x, y, top, floor = 4.7 / 2, 5.5 / 2, 0.42, -2.05
    posts = [
        Part(
            f"post_{i}",
            (0.12, 0.12, top - floor),
            translation(sx * x, sy * y, (top + floor) / 2),
            0.0,
            "steel",
        )
        for i, (sx, sy) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1)))
    ]
    rails = [
        Part(f"rail_{i}", (2 * x, 0.12, 0.16), translation(0.0, s * y, top), 0.0, "steel")
        for i, s in enumerate((-1, 1))
    ]
    beams = [
        Part(f"beam_{i}", (0.12, 2 * y, 0.16), translation(s * x, 0.0, top), 0.0, "steel")
        for i, s in enumerate((-1, 1))
    ]
    return posts + rails + beams


PARTS: dict[str, list[Part]] = {
    "base": _frame_parts(),
    "bridge": [
        Part("bridge", (0.20, 5.5, 0.14), BRIDGE @ translation(0.0, 0.0, 0.57), 160.0, "aluminium"),
    ],
    "carriage": [
        Part("carriage", (0.40, 0.46, 0.10), CARRIAGE @ translation(0.0, 0.0, 0.43), 75.0, "aluminium"),
        Part("slip_ring", (0.07, 0.14), CARRIAGE @ translation(0.0, 0.0, 0.33), 6.0, "carbon"),
        Part("drive_1", (0.115, 0.17), CARRIAGE @ translation(0.0, 0.0, 0.17), 9.0, "drive"),
    ],
    "link_1": [
        Part("flange", (0.115, 0.07), translation(0.0, 0.0, 0.045), 2.2, "aluminium"),
        Part("tube", (0.055, 0.34), translation(0.265, 0.0, 0.03) @ X, 1.7, "carbon"),
        Part("bracket", (0.16, 0.17, 0.10), translation(0.48, 0.0, 0.03), 2.6, "aluminium"),
        Part("drive_2", (0.11, 0.16), translation(giant.UPPER, 0.0, 0.03), 6.6, "drive"),
    ],
    "link_2": [
        Part("flange", (0.105, 0.05), translation(0.0, 0.0, -0.085), 1.6, "aluminium"),
        Part("tube", (0.050, 0.50), translation(0.335, 0.0, -0.09) @ X, 1.9, "carbon"),
        Part("bracket", (0.13, 0.14, 0.09), translation(0.62, 0.0, -0.09), 1.4, "aluminium"),
        Part("drive_3", (0.085, 0.14), translation(giant.LOWER, 0.0, -0.09), 4.0, "drive"),
    ],
    "link_3": [
        Part("flange", (0.08, 0.04), translation(0.0, 0.0, -0.185), 0.8, "aluminium"),
        Part("tube", (0.050, 0.45), translation(0.0, 0.0, -0.43), 2.0, "carbon"),
        Part("fork", (0.10, 0.12, 0.08), translation(0.0, 0.0, -0.68), 0.8, "aluminium"),
        Part("drive_4", (0.075, 0.13), translation(0.0, 0.0, -giant.DROP) @ Y, 4.0, "drive"),
    ],
    # joint 4 turns about z of its frame, the forearm lies along -y
    "link_4": [
        Part("bracket", (0.09, 0.09, 0.07), translation(0.0, -0.10, 0.0), 0.7, "aluminium"),
        Part("tube", (0.038, 0.22), translation(0.0, -0.25, 0.0) @ Y, 0.8, "carbon"),
        Part("drive_5", (0.055, 0.10), translation(0.0, -giant.FOREARM, 0.0), 2.0, "drive"),
    ],
    # joint 5: the handle's axis lies along +x of its frame at q5 = 0 (Rz(90) Rx(90) follows)
    "link_5": [
        Part("bracket", (0.05, 0.06, 0.06), translation(0.02, 0.0, 0.0), 0.6, "aluminium"),
        Part("drive_6", (0.048, 0.075), translation(0.010, 0.0, 0.0) @ X, 2.0, "drive"),
    ],
    "link_6": [
        Part("force_torque_sensor", (0.035, 0.032), translation(0.0, 0.0, 0.062), 0.2, "sensor"),
    ],
    "handle": [
        Part("grip", (0.021, 0.11), translation(0.0, 0.0, 0.015), 0.55, "grip"),
        Part("guard", (0.045, 0.012), translation(0.0, 0.0, -0.037), 0.35, "aluminium"),
    ],
}
"""Parts of each link in the frame of the joint that carries it; those of link_1 on weigh 36.8 kg."""

CAPSULES: dict[str, list[Capsule]] = {
    "base": [
        Capsule(0.085, 2.3, translation(sx * 4.7 / 2, sy * 5.5 / 2, -0.85))
        for sx in (-1, 1)
        for sy in (-1, 1)
    ],
    "bridge": [Capsule(0.15, 5.2, BRIDGE @ translation(0.0, 0.0, 0.57) @ Y)],
    "carriage": [Capsule(0.13, 0.12, CARRIAGE @ translation(0.0, 0.0, 0.21))],
    "link_1": [Capsule(0.12, 0.49, translation(0.265, 0.0, 0.03) @ X)],
    "link_2": [Capsule(0.10, 0.62, translation(0.335, 0.0, -0.09) @ X)],
    "link_3": [Capsule(0.085, 0.52, translation(0.0, 0.0, -0.47))],
    "link_4": [Capsule(0.065, 0.36, translation(0.0, -0.22, 0.0) @ Y)],
    "link_5": [Capsule(0.058, 0.06, translation(0.02, 0.0, 0.0) @ X)],
    "handle": [Capsule(0.05, 0.09, translation(0.0, 0.0, 0.0))],
}

FRAMES = {
    "imu_carriage": ("carriage", CARRIAGE @ translation(0.15, 0.0, 0.37)),
    "force_torque": ("link_6", translation(0.0, 0.0, 0.078)),
    "imu_handle": ("handle", translation(0.0, 0.0, -0.005)),
}
"""Sensor frames: name -> (link, pose in it)."""


def inertial(parts: Sequence[Part]) -> tuple[float, Array, Array]:
    """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m^2] of rigidly joined parts."""
    mass = sum(part.mass for part in parts)
    centre = sum((part.mass * part.pose[:3, 3] for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        R, r = part.pose[:3, :3], part.pose[:3, 3] - centre
        inertia += R @ np.diag(part.inertia()) @ R.T + part.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return mass, centre, inertia


def urdf() -> str:
    """The whole description as XML text."""
    robot = ET.Element("robot", name="giant")
    for colour, rgb in COLOURS.items():
        material = ET.SubElement(robot, "material", name=colour)
        ET.SubElement(material, "color", rgba=" ".join(f"{c:g}" for c in (*rgb, 1.0)))
    for link in PARTS:
        _link(robot, link)
    for frame in FRAMES:
        ET.SubElement(robot, "link", name=frame)

    links = list(PARTS)
    before = giant.T_BASE_DH
    for row, parent, child in zip(giant.DH, links, links[1:], strict=False):
        _moving_joint(robot, row.name, parent, child, before)
        before = row.link()
    _fixed_joint(robot, "handle_mount", "link_6", "handle", before)
    for frame, (link, pose) in FRAMES.items():
        _fixed_joint(robot, f"{frame}_mount", link, frame, pose)
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _link(robot: ET.Element, name: str) -> None:
    link = ET.SubElement(robot, "link", name=name)
    parts = PARTS[name]
    if sum(part.mass for part in parts) > 0.0:
        mass, centre, inertia = inertial(parts)
        body = ET.SubElement(link, "inertial")
        _origin(body, translation(*centre))
        ET.SubElement(body, "mass", value=_number(mass))
        entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        ET.SubElement(body, "inertia", {key: _number(inertia[at]) for key, at in entries.items()})
    for part in parts:
        visual = ET.SubElement(link, "visual", name=f"{name}_{part.name}")
        _origin(visual, part.pose)
        _shape(visual, part.size)
        ET.SubElement(visual, "material", name=part.colour)
    capsules = CAPSULES.get(name, [])
    for i, capsule in enumerate(capsules):
        collision = ET.SubElement(link, "collision", name=f"{name}_{i}")
        _origin(collision, capsule.pose)
        _shape(collision, (capsule.radius, capsule.length))
    if capsules:  # pinocchio's own element: these cylinders are capsules
        checking = ET.SubElement(link, "collision_checking")
        for i in range(len(capsules)):
            ET.SubElement(checking, "capsule", name=f"{name}_{i}")


def _shape(parent: ET.Element, size: tuple[float, ...]) -> None:
    geometry = ET.SubElement(parent, "geometry")
    if len(size) == 2:
        ET.SubElement(geometry, "cylinder", radius=_number(size[0]), length=_number(size[1]))
    else:
        ET.SubElement(geometry, "box", size=" ".join(map(_number, size)))


def _moving_joint(robot: ET.Element, name: str, parent: str, child: str, pose: Array) -> None:
    limits = JOINTS[name]
    kind = "prismatic" if name.startswith("ppu") else "continuous" if limits.upper == inf else "revolute"
    joint = _joint(robot, name, kind, parent, child, pose)
    ET.SubElement(joint, "axis", xyz="0 0 1")
    limit = {"effort": _number(limits.effort), "velocity": _number(limits.velocity)}
    if kind != "continuous":
        limit |= {"lower": _number(limits.lower), "upper": _number(limits.upper)}
    ET.SubElement(joint, "limit", limit)
    ET.SubElement(joint, "dynamics", damping=_number(limits.damping))


def _fixed_joint(robot: ET.Element, name: str, parent: str, child: str, pose: Array) -> None:
    _joint(robot, name, "fixed", parent, child, pose)


def _joint(robot: ET.Element, name: str, kind: str, parent: str, child: str, pose: Array) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    _origin(joint, pose)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    return joint


def _origin(parent: ET.Element, pose: Array) -> None:
    R = pose[:3, :3]
    if abs(R[2, 0]) > 1.0 - 1e-12:  # pitch of +-90 deg: roll and yaw share one axis, so yaw = 0
        roll, pitch, yaw = (
            np.arctan2(-R[2, 0] * R[0, 1], R[1, 1]),
            np.arcsin(np.clip(-R[2, 0], -1.0, 1.0)),
            0.0,
        )
    else:
        roll, pitch, yaw = np.arctan2(R[2, 1], R[2, 2]), np.arcsin(-R[2, 0]), np.arctan2(R[1, 0], R[0, 0])
    ET.SubElement(
        parent,
        "origin",
        xyz=" ".join(map(_number, pose[:3, 3])),
        rpy=" ".join(map(_number, (roll, pitch, yaw))),
    )


def _number(value: float) -> str:
    value = round(float(value), 15)
    return repr(value + 0.0)


if __name__ == "__main__":
    sys.stdout.write(urdf())
