"""Takes a serial arm out of anybody's URDF: the chain to a tip, with everything else frozen to it."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite

import numpy as np
import pinocchio as pin

from ...configs.numerals import number
from ...configs.ranges import RANGES
from ...configs.words import counted, nearest
from ...models import Array
from ...models.xml_tree import Element, parse
from .check import FEWEST, MOST
from .errors import InitError

MOVING = ("revolute", "continuous", "prismatic")
HANDLE, SENSOR = "handle", "force_torque"
GRIP_LENGTH, GRIP_RADIUS = 0.1, 0.016
"""Size of the handle that is put on the tip [m]."""
LEAST_MASS, LEAST_GYRATION = 1e-3, 0.005
"""Mass of a link that moves: less is taken for nothing [kg]; sqrt(moment / mass) that any part has [m]."""
UNKNOWN_MASS, UNKNOWN_RADIUS = 0.1, 0.03
"""What is guessed of a link that a joint moves and that has no mass [kg, m]."""
GRASPING = ("gripper", "finger", "thumb", "jaw", "claw")
"""Words in the names of joints that close a gripper; of the links that they move, all but the first."""
SMALLEST, LARGEST = RANGES["size"].lower, RANGES["size"].upper
TIPS = ("tcp", "tool0", "tool", "ee", "flange", "hand", "gripper")
"""Words in the names of links that people hold an arm at, best first."""


@dataclass(frozen=True, slots=True)
class Body:
    """Mass [kg], centre (3,) [m] and inertia about it (3, 3) [kg m^2], in the frame of the link."""

    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint as it is understood.

    Attributes:
        name, kind, parent, child: as written; the kind becomes "fixed" where the joint is frozen.
        xyz, rpy: its place.
        axis: unit vector.
        lower, upper: infinite where there is no limit.
        effort, velocity: 0 where the file says nothing.
        damping: viscous friction.
        follows: the joint that it follows; "" for none.
        written: its name in the file, whatever it is called here.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz: tuple[float, ...]
    rpy: tuple[float, ...]
    axis: tuple[float, ...] = (1.0, 0.0, 0.0)
    lower: float = -inf
    upper: float = inf
    effort: float = 0.0
    velocity: float = 0.0
    damping: float = 0.0
    follows: str = ""
    written: str = ""

    @property
    def moves(self) -> bool:
        """Whether a motor may move it."""
        return self.kind in MOVING and not self.follows and self.lower < self.upper


@dataclass(frozen=True, slots=True)
class Primitive:
    """A collision shape of a link: what the URDF calls it, its numbers by their names, and its place."""

    kind: str
    numbers: dict[str, tuple[float, ...]]
    xyz: tuple[float, ...]
    rpy: tuple[float, ...]


@dataclass(slots=True)
class Description:
    """A serial arm.

    Attributes:
        name: of the robot.
        joints: that move, from base to tip, by their names.
        links: bodies of the links, by their names; None where one is a mere frame.
        frozen: fixed joints.
        shapes: for collisions, of links that have any.
        handle: mass of the handle that is put on the tip [kg].
        remarks: what was left out, frozen, mended or guessed, a sentence each.
        source: name of the file.
    """

    name: str
    joints: dict[str, Joint]
    links: dict[str, Body | None]
    frozen: list[Joint]
    shapes: dict[str, list[Primitive]] = field(default_factory=dict)
    handle: float = 0.3
    remarks: list[str] = field(default_factory=list)
    source: str = ""


def read_arm(text: str, source: str, tip: str | None) -> Description:
    """The chain from the root of a URDF to a tip, or to where it ends or branches.

    Raises:
        InitError: there is no such tip, or no arm with three to seven joints and masses on the way to it.
        ModelError: the text is no XML, or too much of it.
    """
    root = parse(text, source)
    if root.tag != "robot":
        raise InitError(f"{source}: the root element is <{root.tag}>; a URDF starts with <robot name=...>")
    _require_expanded(root, source)
    links = {_name(link, source): _body(link, source) for link in root.all("link")}
    joints = [_joint(joint, source) for joint in root.all("joint")]
    shapes = {_name(link, source): _primitives(link, source) for link in root.all("link")}
    tree = _Tree(links, joints, source, shapes)
    remarks: list[str] = []
    every = sum(len(link.all("visual")) + len(link.all("collision")) for link in root.all("link"))
    unused = every - sum(map(len, shapes.values()))
    if unused:
        remarks.append(
            f"{unused} shapes and their meshes are left out: only primitives for collisions are kept"
        )
    end = tree.end(tip)
    if tip is None:
        remarks.append(f"the tip is taken to be '{end}'; --tip names another")
    chain = tree.chain(end)
    if tip is None:
        remarks += _closing(chain, joints, tree)
    _require_arm(chain, tree, source)
    arm = _gather(root.attributes.get("name", "arm"), chain, tree, remarks)
    arm.source = source
    _require_masses(arm, source)
    _mend(arm)
    return arm


class _Tree:
    """Links and the joints between them."""

    def __init__(
        self,
        links: Mapping[str, Body | None],
        joints: Sequence[Joint],
        source: str,
        shapes: Mapping[str, list[Primitive]],
    ) -> None:
        self.links, self.source, self.shapes = links, source, shapes
        self.above: dict[str, Joint] = {}
        self.below: dict[str, list[Joint]] = {name: [] for name in links}
        for joint in joints:
            for link in (joint.parent, joint.child):
                if link not in links:
                    raise InitError(
                        f"{source}: joint '{joint.name}' names the link '{link}', which is not there"
                    )
            if joint.child in self.above:
                raise InitError(f"{source}: the link '{joint.child}' has two parent joints; a URDF is a tree")
            self.above[joint.child] = joint
            self.below[joint.parent].append(joint)
        roots = [name for name in links if name not in self.above]
        if len(roots) != 1:
            if not roots:
                what = (
                    "every link has a parent joint, so the joints form a loop"
                    if links
                    else "there are no links"
                )
                raise InitError(f"{source}: {what}; a URDF is a tree with one root")
            what = ", ".join(roots[:5]) + (", ..." if len(roots) > 5 else "")
            raise InitError(f"{source}: {len(roots)} links have no parent ({what}); connect all to one root")
        self.root = roots[0]

    def ways(self, link: str) -> list[Joint]:
        """Joints of a link that lead to anything that moves, or would if it did not follow another."""
        return [
            joint
            for joint in self.below[link]
            if (joint.kind in MOVING and joint.lower < joint.upper) or self.ways(joint.child)
        ]

    def end(self, tip: str | None) -> str:
        """The tip, or the link at which the only way to moving joints ends."""
        if tip is not None:
            if tip not in self.links:
                near = nearest(tip, self.links)
                meant = f"did you mean '{near}'? " if near else ""
                raise InitError(
                    f"{self.source}: there is no link '{tip}'; {meant}{self.tips('candidates: ')}"
                )
            return tip
        link = self.root
        while len(ways := self.ways(link)) == 1:
            link = ways[0].child
        if len(ways) > 1 and not any(joint.moves for joint in self.chain(link)):
            raise InitError(
                f"{self.source} branches at '{link}' before anything moves; "
                f"{self.tips('say where the hand holds it: --tip with one of ')}"
            )
        return link if ways else self.tool(link)

    def tool(self, link: str) -> str:
        """A mere frame fixed to a link whose name says that people hold the arm there, or the link."""
        frames = [joint.child for joint in self.below[link] if self.links[joint.child] is None]
        for word in TIPS:
            for frame in frames:
                if word in frame.lower():
                    return self.tool(frame)
        return link

    def chain(self, link: str) -> list[Joint]:
        """Joints from the root to a link."""
        found: list[Joint] = []
        while link != self.root:
            found.append(self.above[link])
            link = self.above[link].parent
            if len(found) > len(self.links):
                raise InitError(f"{self.source}: the joints form a loop; a URDF is a tree")
        return found[::-1]

    def tips(self, before: str) -> str:
        """A sentence with the links that may be named, or why there is none."""
        known = self.leaves()
        none = (
            f"no way from '{self.root}' to any link has {FEWEST} to {MOST} joints, so there is no arm in it"
        )
        return f"{before}{', '.join(known)}" if known else none

    def leaves(self) -> list[str]:
        """Links at which 3 to 7 joints end, the longest way first, as people may have meant them."""
        ways = {link: sum(joint.moves for joint in self.chain(link)) for link in self.links}
        known = [
            link
            for link, count in ways.items()
            if FEWEST <= count <= MOST and not any(joint.moves for joint in self.below[link])
        ]
        return sorted(known, key=lambda link: -ways[link])[:12] or []


def _closing(chain: Sequence[Joint], joints: Sequence[Joint], tree: _Tree) -> list[str]:
    """What to do about a last joint that closes a gripper, where an arm is left without it."""
    moving = [joint for joint in chain if joint.moves]
    if len(moving) <= FEWEST:
        return []
    last = moving[-1]
    named = any(word in last.name.lower() for word in GRASPING) or any(
        word in last.child.lower() for word in GRASPING[1:]
    )
    if named or any(joint.follows == last.name for joint in joints):
        return [
            f"'{last.name}', the last joint, looks like a gripper's, which the hand would open and close; "
            f"--tip {tree.tool(last.parent)} leaves it out"
        ]
    return []


def _require_expanded(element: Element, source: str) -> None:
    if element.tag.startswith("xacro:") or any("${" in value for value in element.attributes.values()):
        raise InitError(f"{source}:{element.line}: this is a xacro, not a URDF; expand it first: xacro FILE")
    for child in element.children:
        _require_expanded(child, source)


def _require_arm(chain: Sequence[Joint], tree: _Tree, source: str) -> None:
    for joint in chain:
        if joint.kind in ("floating", "planar"):
            raise InitError(f"{source}: '{joint.name}' is {joint.kind}; give a URDF whose base stands")
    moving = [joint.name for joint in chain if joint.moves]
    if FEWEST <= len(moving) <= MOST:
        return
    end = chain[-1].child if chain else tree.root
    what = f"{counted(len(moving), 'joint')} ({', '.join(moving)})" if moving else "no joint"
    raise InitError(
        f"{source}: {what} can move between '{tree.root}' and '{end}'; an arm has {FEWEST} to {MOST}. "
        f"{tree.tips('Name another tip with --tip: ')}"
    )


def _gather(name: str, chain: Sequence[Joint], tree: _Tree, remarks: list[str]) -> Description:
    """The chain, and what hangs on it, frozen."""
    first = next(i for i, joint in enumerate(chain) if joint.moves)
    on_chain = {chain[0].parent, *(joint.child for joint in chain)}
    joints: dict[str, Joint] = {}
    frozen, dropped, kept, stuck = [], [], dict[str, Body | None](), []
    for i, joint in enumerate(chain):
        kept.setdefault(joint.parent, tree.links[joint.parent])
        kept[joint.child] = tree.links[joint.child]
        if joint.moves:
            joints[joint.name] = joint
        else:
            frozen.append(_frozen(joint))
            stuck += [joint.name] if joint.kind != "fixed" else []
        if i < first:
            continue
        branches = [other for other in tree.below[joint.child] if other.child not in on_chain]
        while branches:
            other = branches.pop()
            branches += tree.below[other.child]
            stuck += [other.name] if other.kind != "fixed" else []
            empty = tree.links[other.child] is None and not tree.shapes[other.child]
            if empty and not tree.below[other.child]:
                dropped.append(other.child)
            else:
                kept[other.child] = tree.links[other.child]
                frozen.append(_frozen(other))
    standing = [chain[0].parent, *(joint.child for joint in chain[:first])]
    aside = [other.name for link in standing for other in tree.below[link] if other.child not in on_chain]
    if aside:
        remarks.append(f"left out, for nothing that moves carries them: {', '.join(sorted(aside))}")
    if stuck:
        remarks.append(f"frozen where they stand, with what they carry: {', '.join(sorted(stuck))}")
    if dropped:
        remarks.append(f"merged into what carries them, for they weigh nothing: {', '.join(sorted(dropped))}")
    kept[chain[first].parent] = None  # what does not move needs no mass
    shapes = {link: tree.shapes[link] for link in kept if tree.shapes[link]}
    return _renamed(Description(name, joints, kept, frozen, shapes, remarks=remarks), chain[-1].child)


def _frozen(joint: Joint) -> Joint:
    """The joint as a fixed one, at 0 or at the end of its range that is next to it."""
    at = min(max(0.0, joint.lower), joint.upper)
    if joint.kind == "fixed" or not at:
        return replace(joint, kind="fixed")
    R, axis = pin.rpy.rpyToMatrix(*joint.rpy), np.array(joint.axis)
    xyz = np.array(joint.xyz)
    if joint.kind == "prismatic":
        xyz = xyz + R @ (at * axis)
    else:
        R = R @ pin.exp3(at * axis)
    return replace(joint, kind="fixed", xyz=tuple(xyz), rpy=tuple(pin.rpy.matrixToRpy(R)))


def _renamed(arm: Description, tip: str) -> Description:
    """Names that a configuration can hold, no two alike; sensor and handle on the tip."""
    taken = {"universe", HANDLE, SENSOR}
    new: dict[tuple[str, str], str] = {}

    def unique(kind: str, name: str) -> None:
        plain = re.sub(r"[^A-Za-z0-9_-]", "_", name)[:60] or kind
        tries = (plain, f"{plain}_{kind}", *(f"{plain}_{kind}_{i}" for i in range(2, 999)))
        new[kind, name] = next(word for word in tries if word not in taken)
        taken.add(new[kind, name])

    for link in arm.links:
        unique("link", link)
    for joint in (*arm.joints.values(), *arm.frozen):
        unique("joint", joint.name)
    other = [f"'{name}' is called '{word}'" for (_, name), word in new.items() if name != word]
    if other:
        arm.remarks.append(f"{', '.join(other)}: names are letters and digits, and all differ")

    def rename(joint: Joint) -> Joint:
        parent, child = new["link", joint.parent], new["link", joint.child]
        return replace(joint, name=new["joint", joint.name], parent=parent, child=child)

    end, zero = new["link", tip], (0.0, 0.0, 0.0)
    mounts = [
        Joint(f"{SENSOR}_mount", "fixed", end, SENSOR, zero, zero),
        Joint(f"{HANDLE}_mount", "fixed", end, HANDLE, (0.0, 0.0, GRIP_LENGTH), zero),
    ]
    joints = {new["joint", name]: rename(joint) for name, joint in arm.joints.items()}
    links = {new["link", name]: body for name, body in arm.links.items()}
    return Description(
        re.sub(r"[^A-Za-z0-9_-]", "_", arm.name)[:60] or "arm",
        joints,
        {**links, SENSOR: None, HANDLE: None},
        [*map(rename, arm.frozen), *mounts],
        {new["link", name]: shapes for name, shapes in arm.shapes.items()},
        remarks=arm.remarks,
    )


def _require_masses(arm: Description, source: str) -> None:
    if not any(body for body in arm.links.values()):
        raise InitError(
            f"{source}: no link that moves has a mass; forces cannot be computed without <inertial> elements"
        )


def _mend(arm: Description) -> None:
    """Masses where joints move none, inertias that bodies can have, and a handle in proportion."""
    rigid: dict[str, list[str]] = {name: [] for name in arm.links}
    for joint in arm.frozen:
        rigid[joint.parent].append(joint.child)

    def has_mass(link: str) -> bool:
        return link == HANDLE or arm.links[link] is not None or any(map(has_mass, rigid[link]))

    for joint in arm.joints.values():
        if not has_mass(joint.child):
            moment = 0.4 * UNKNOWN_MASS * UNKNOWN_RADIUS**2
            arm.links[joint.child] = Body(UNKNOWN_MASS, np.zeros(3), moment * np.eye(3))
            arm.remarks.append(
                f"'{joint.child}' has no mass, and a joint moves it: guessed {UNKNOWN_MASS:g} kg"
            )
    for name, body in arm.links.items():
        if body is not None and (better := _possible(body)) is not None:
            arm.links[name] = better
            arm.remarks.append(f"the inertia of '{name}' belongs to no rigid body: the nearest one is taken")
    total = sum(body.mass for body in arm.links.values() if body)
    arm.handle = float(f"{min(max(0.05 * total, 0.02), 0.5):.2g}")
    mass, r, h = arm.handle, GRIP_RADIUS, GRIP_LENGTH
    across = mass * (3.0 * r * r + h * h) / 12.0
    centre = np.array([0.0, 0.0, -0.3 * h])
    arm.links[HANDLE] = Body(mass, centre, np.diag([across, across, mass * r * r / 2.0]))
    grip: dict[str, tuple[float, ...]] = {"radius": (r,), "length": (h,)}
    arm.shapes[HANDLE] = [Primitive("cylinder", grip, tuple(centre.tolist()), (0.0, 0.0, 0.0))]
    arm.remarks.append(
        f"a handle of {mass:g} kg on a force-torque sensor is put on the tip, along its z axis"
    )


def _possible(body: Body) -> Body | None:
    """The body with moments that a rigid one can have; None where they are."""
    moments, axes = np.linalg.eigh(body.inertia)
    least = body.mass * LEAST_GYRATION**2
    mended = np.maximum(moments, least)
    short = mended[2] - mended[0] - mended[1]
    if short > 0.0:
        mended[:2] += 0.51 * short
    if np.array_equal(mended, moments):
        return None
    return Body(body.mass, body.centre, axes @ np.diag(mended) @ axes.T)


def _name(element: Element, source: str) -> str:
    name = element.attributes.get("name", "")
    if not name:
        raise InitError(f"{source}:{element.line}: a <{element.tag}> without a name")
    return name


def _numbers(element: Element | None, key: str, default: tuple[float, ...], source: str) -> tuple[float, ...]:
    if element is None or key not in element.attributes:
        return default
    text = element.attributes[key]
    values = [number(word) for word in text.split()]
    known = tuple(value for value in values if value is not None and isfinite(value))
    if len(known) != len(default) or len(values) != len(default):
        what = f'{source}:{element.line}: <{element.tag} {key}="{text[:40]}">'
        raise InitError(f"{what}: give {len(default)} finite number{'s' if len(default) > 1 else ''}")
    return known


def _scalar(element: Element | None, key: str, default: float, source: str) -> float:
    if element is None or key not in element.attributes:
        return default
    return _numbers(element, key, (0.0,), source)[0]


def _pose(element: Element, source: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    origin, zero = element.child("origin"), (0.0, 0.0, 0.0)
    return _numbers(origin, "xyz", zero, source), _numbers(origin, "rpy", zero, source)


def _body(link: Element, source: str) -> Body | None:
    inertial = link.child("inertial")
    if inertial is None:
        return None
    mass = _scalar(inertial.child("mass"), "value", 0.0, source)
    if mass < LEAST_MASS:
        return None
    xyz, rpy = _pose(inertial, source)
    matrix, entries = np.zeros((3, 3)), inertial.child("inertia")
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        matrix[i, j] = matrix[j, i] = _scalar(entries, f"i{'xyz'[i]}{'xyz'[j]}", 0.0, source)
    R = pin.rpy.rpyToMatrix(*rpy)
    return Body(mass, np.array(xyz), R @ matrix @ R.T)


SIZES: dict[str, dict[str, tuple[float, ...]]] = {
    "box": {"size": (0.0, 0.0, 0.0)},
    "cylinder": {"radius": (0.0,), "length": (0.0,)},
    "capsule": {"radius": (0.0,), "length": (0.0,)},
    "sphere": {"radius": (0.0,)},
}
"""Numbers of primitives, by their names in a URDF."""


def _primitives(link: Element, source: str) -> list[Primitive]:
    """Collision shapes of a link that are no meshes; what has no size is none."""
    found: list[Primitive] = []
    for element in link.all("collision"):
        geometry = element.child("geometry")
        for kind, sizes in SIZES.items():
            described = geometry.child(kind) if geometry else None
            if described is None:
                continue
            numbers = {key: _numbers(described, key, zero, source) for key, zero in sizes.items()}
            shape = Primitive(kind, numbers, *_pose(element, source))
            fits = all(SMALLEST <= value <= LARGEST for values in numbers.values() for value in values)
            if fits and shape not in found:
                found.append(shape)
    return found


def _joint(element: Element, source: str) -> Joint:
    name, kind = _name(element, source), element.attributes.get("type", "")
    if kind not in (*MOVING, "fixed", "floating", "planar"):
        raise InitError(f"{source}:{element.line}: joint '{name}' has the type '{kind[:40]}'")
    xyz, rpy = _pose(element, source)
    limit = element.child("limit")
    lower, upper = -inf, inf
    ends = limit.attributes.keys() & {"lower", "upper"} if limit is not None else set()
    if kind in ("revolute", "prismatic") and ends:
        lower, upper = (_scalar(limit, key, 0.0, source) for key in ("lower", "upper"))
    axis = np.array(_numbers(element.child("axis"), "xyz", (1.0, 0.0, 0.0), source))
    length = float(np.linalg.norm(axis))
    if kind in MOVING and length < 1e-6:
        raise InitError(f"{source}:{element.line}: the axis of joint '{name}' has no direction")
    return Joint(
        name,
        kind,
        _end(element, "parent", source),
        _end(element, "child", source),
        xyz,
        rpy,
        axis=tuple((axis / (length or 1.0)).tolist()),
        lower=lower,
        upper=upper,
        effort=_scalar(limit, "effort", 0.0, source),
        velocity=_scalar(limit, "velocity", 0.0, source),
        damping=max(0.0, _scalar(element.child("dynamics"), "damping", 0.0, source)),
        follows=_followed(element),
        written=name,
    )


def _followed(joint: Element) -> str:
    mimic = joint.child("mimic")
    return "" if mimic is None else mimic.attributes.get("joint") or "another"


def _end(joint: Element, end: str, source: str) -> str:
    child = joint.child(end)
    if child is None or "link" not in child.attributes:
        raise InitError(f"{source}:{joint.line}: joint '{joint.attributes['name']}' has no {end}")
    return child.attributes["link"]


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
