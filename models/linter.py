"""Refuses robot descriptions that pinocchio would load and a machine would not survive.

pinocchio reads missing limits as zero, accepts lower > upper, negative masses, zero axes and zero
velocities, and turns degrees into radians without a word; its parser complains about ``xyz="nan nan nan"``
and goes on, takes the first of two elements, and skips those that it does not know. So a description is
read here, by a grammar of its own (``grammar``, ``ranges``), and pinocchio gets what was understood.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from math import hypot

import numpy as np

from ..configs.ranges import RANGES
from .findings import Findings, near, shown
from .grammar import CONTINUOUS, FIXED, ROBOT
from .reader import read
from .xml_tree import Element, parse

MAX_LINKS = 200
"""pinocchio's builder overflows its stack with some thousand links in a row."""
WORLD = "universe"
"""pinocchio's frame of the base."""
UNIT_LENGTH = 1e-3
"""How far the length of an axis may be from 1."""


def lint(text: str, source: str) -> str:
    """Check a URDF for what would be dangerous on a machine.

    Returns:
        What was understood, as XML: links with their inertia, joints with their places, axes, limits and
        damping, all defaults written out, and nothing else.

    Raises:
        ModelError: with everything that is wrong, each with file, line, reason and fix.
    """
    found = Findings(source)
    robot = parse(text, source)
    if robot.tag != "robot":
        found.refuse(
            robot, f"the root element is <{shown(robot.tag)}>", "a URDF starts with <robot name=...>"
        )
    if len(robot.all("link")) > MAX_LINKS:
        found.refuse(robot, f"{len(robot.all('link'))} links", f"at most {MAX_LINKS} are supported")
    found.require_none()
    read(robot, ROBOT, found)
    for link in filter(_is_sound, robot.all("link")):
        _lint_link(link, found)
    for joint in filter(_is_sound, robot.all("joint")):
        _lint_joint(joint, found)
    parts = [*robot.all("link"), *robot.all("joint")]
    links, joints = _by_name(robot.all("link")), _by_name(robot.all("joint"))
    if all(map(_is_placed, parts)) and len(links) + len(joints) == len(parts):
        before = len(found)
        _lint_tree(robot, links, joints, found)
        if len(found) == before:
            _require_moving_mass(links, joints, found)
    found.require_none()
    return ET.tostring(_understood(robot), encoding="unicode")


def _is_sound(element: Element) -> bool:
    """Whether its numbers are there to be judged."""
    return element.sound


def _is_placed(element: Element) -> bool:
    """Whether a link or joint says what the tree needs of it: names, and of a joint its type."""
    if element.tag == "link":
        return bool(element.attributes.get("name"))
    ends = [element.child(end) for end in ("parent", "child")]
    named = all(end and end.attributes.get("link") for end in ends)
    return named and all(element.attributes.get(key) for key in ("name", "type"))


def _lint_link(link: Element, found: Findings) -> None:
    for shape in (*link.all("visual"), *link.all("collision")):
        mesh = shape.need("geometry").child("mesh")
        filename = mesh.attributes["filename"] if mesh else ""
        if mesh and (filename.startswith("/") or "://" in filename or ".." in filename.split("/")):
            problem = f"mesh '{filename}' lies outside the description's folder"
            found.refuse(mesh, problem, "use a relative path")
    cylinders = {
        shape.attributes.get("name")
        for shape in link.all("collision")
        if shape.need("geometry").child("cylinder")
    }
    checking = link.child("collision_checking")
    for capsule in checking.children if checking else ():
        if capsule.attributes["name"] not in cylinders:
            problem = f"capsule '{capsule.attributes['name']}' is none of the link's collision cylinders"
            found.refuse(capsule, problem, "name one of them")
    if body := link.child("inertial"):
        _lint_inertial(body, link.attributes["name"], found)


def _lint_inertial(body: Element, name: str, found: Findings) -> None:
    inertia, (mass,) = body.need("inertia"), body.need("mass").numbers["value"]
    matrix = np.zeros((3, 3))
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        (value,) = inertia.numbers[f"i{'xyz'[i]}{'xyz'[j]}"]
        matrix[i, j] = matrix[j, i] = value
    moments = np.linalg.eigvalsh(matrix).tolist()
    shown = ", ".join(f"{moment:g}" for moment in moments)
    if moments[0] <= 0.0 or moments[0] + moments[1] < moments[2] * (1.0 - 1e-6):
        problem = f"link '{name}': moments {shown} belong to no rigid body"
        found.refuse(inertia, problem, "all must be positive and none above the sum of the others")
        return
    least, most = RANGES["gyration"].lower, RANGES["gyration"].upper
    if not least**2 * mass <= moments[0] <= moments[2] <= most**2 * mass:
        problem = f"link '{name}': moments {shown} kg m^2 of {mass:g} kg"
        found.refuse(inertia, problem, f"sqrt(moment / mass) lies in {RANGES['gyration']}")


def _lint_joint(joint: Element, found: Findings) -> None:
    name, kind = joint.attributes["name"], joint.attributes["type"]
    if kind == FIXED:
        return
    axis, limit = joint.need("axis"), joint.need("limit")
    length = hypot(*axis.numbers["xyz"])
    if abs(length - 1.0) > UNIT_LENGTH:
        found.refuse(axis, f"joint '{name}': the axis has length {length:g}", "give a unit vector")
    if kind == CONTINUOUS:
        return
    (lower,), (upper,) = limit.numbers["lower"], limit.numbers["upper"]
    if lower >= upper:
        problem = f"joint '{name}': lower = {lower:g} is not below upper = {upper:g}"
        found.refuse(limit, problem, "swap or mend them")


def _lint_tree(
    robot: Element, links: Mapping[str, Element], joints: Mapping[str, Element], found: Findings
) -> None:
    """One root from which every link is reached, once; no frame with the name of another."""
    for name, element in (*links.items(), *joints.items()):
        if name == WORLD or (name in links and name in joints):
            what = "means the world" if name == WORLD else "is the name of a link and of a joint"
            found.refuse(element, f"'{name}' {what}", "rename it: frames are found by their names")
    before = len(found)
    below: dict[str, list[str]] = {name: [] for name in links}
    carried: set[str] = set()
    for joint in joints.values():
        name, (parent, child) = joint.attributes["name"], _ends(joint)
        for end, link in (("parent", parent), ("child", child)):
            if link not in links:
                problem = f"joint '{name}': {end} link '{link}' does not exist"
                found.refuse(joint, problem, near(link, links))
        if child in carried:
            problem = f"link '{child}' has two parent joints"
            found.refuse(joint, problem, "a URDF is a tree: remove one of them")
        carried.add(child)
        below.setdefault(parent, []).append(child)
    if len(found) > before:
        return  # who is the root, and who is loose, is to be seen when the ends are right
    roots = [name for name in links if name not in carried]
    if len(roots) != 1:
        what = ", ".join(shown(root) for root in roots[:5]) or "a loop"
        problem = f"{len(roots)} links without a parent: {what}"
        found.refuse(robot, problem, "connect all links to one root")
        return
    reached, front = set(roots), list(roots)
    while front:
        children = below[front.pop()]
        reached.update(children)
        front += children
    if loose := [name for name in links if name not in reached]:
        problem = f"links that no joint connects to '{roots[0]}': {', '.join(map(shown, loose[:5]))}"
        found.refuse(links[loose[0]], problem, "break the loop")


def _require_moving_mass(
    links: Mapping[str, Element], joints: Mapping[str, Element], found: Findings
) -> None:
    """Every moving joint must carry some mass: a massless one has no finite acceleration."""
    rigid: dict[str, list[str]] = {name: [] for name in links}
    for joint in joints.values():
        if joint.attributes["type"] == FIXED:
            parent, child = _ends(joint)
            rigid[parent].append(child)

    def has_mass(link: str) -> bool:
        return links[link].child("inertial") is not None or any(map(has_mass, rigid[link]))

    for joint in joints.values():
        if joint.attributes["type"] != FIXED and not has_mass(_ends(joint)[1]):
            problem = f"joint '{joint.attributes['name']}' moves a link without mass"
            found.refuse(joint, problem, "give its child link an <inertial>")


_KEPT = {
    **{"robot": ("name",), "link": ("name",), "joint": ("name", "type")},
    **{"parent": ("link",), "child": ("link",)},
    **dict.fromkeys(("inertial", "origin", "mass", "inertia", "axis", "limit", "dynamics"), ()),
}
"""Elements that make the model, with their attributes that are no numbers."""


def _understood(element: Element) -> ET.Element:
    texts = {name: element.attributes[name] for name in _KEPT[element.tag]}
    numbers = {name: " ".join(map(repr, values)) for name, values in element.numbers.items()}
    kept = ET.Element(element.tag, texts | numbers)
    kept.extend(_understood(child) for child in element.children if child.tag in _KEPT)
    return kept


def _by_name(elements: Sequence[Element]) -> dict[str, Element]:
    return {element.attributes.get("name", ""): element for element in elements}


def _ends(joint: Element) -> tuple[str, str]:
    return joint.need("parent").attributes["link"], joint.need("child").attributes["link"]
