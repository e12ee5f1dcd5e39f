"""Refuses robot descriptions that pinocchio would load and a machine would not survive.

pinocchio reads missing limits as zero, accepts lower > upper, negative masses, zero axes and zero
velocities, and turns degrees into radians without a word.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite, pi
from xml.parsers import expat

import numpy as np

from .errors import ModelError

MAX_BYTES = 4 << 20
MOVING = ("revolute", "continuous", "prismatic")


@dataclass(slots=True)
class Element:
    """An XML element that knows its line."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def child(self, tag: str) -> Element | None:
        """First child of that tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def all(self, tag: str) -> list[Element]:
        """All children of that tag."""
        return [child for child in self.children if child.tag == tag]


def parse(text: str, source: str) -> Element:
    """Root element of an XML text.

    Raises:
        ModelError: for malformed XML, a document type (entities can explode) or more than 4 MiB.
    """
    if len(text) > MAX_BYTES:
        raise ModelError(
            source, 0, f"{len(text)} bytes of XML", f"keep the description below {MAX_BYTES} bytes"
        )
    parser = expat.ParserCreate()
    top = Element("", {}, 0)
    stack = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, parser.CurrentLineNumber)
        stack[-1].children.append(element)
        stack.append(element)

    def refuse_doctype(*_: object) -> None:
        raise ModelError(
            source, parser.CurrentLineNumber, "a document type declaration", "remove <!DOCTYPE ...>"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ModelError(
            source, error.lineno, f"not XML: {expat.ErrorString(error.code)}", "mend the file"
        ) from error
    return top.children[0]


def lint(text: str, source: str) -> None:
    """Check a URDF for what would be dangerous on a machine.

    Raises:
        ModelError: at the first finding, with file, line, reason and fix.
    """
    robot = parse(text, source)
    if robot.tag != "robot":
        raise ModelError(
            source, robot.line, f"the root element is <{robot.tag}>", "a URDF starts with <robot name=...>"
        )
    links = _named(robot, "link", source)
    joints = _named(robot, "joint", source)
    for link in links.values():
        _lint_meshes(link, source)
        _lint_inertial(link, source)
    children: dict[str, Element] = {}
    for joint in joints.values():
        child = _lint_joint(joint, links, source)
        if child in children:
            raise ModelError(
                source,
                joint.line,
                f"link '{child}' has two parent joints",
                "a URDF is a tree: remove one of them",
            )
        children[child] = joint
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise ModelError(
            source, robot.line, f"{len(roots)} links without a parent: {', '.join(roots) or 'a loop'}",
            "connect all links to one root",
        )  # fmt: skip
    _require_moving_mass(links, joints, source)


def _named(robot: Element, tag: str, source: str) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in robot.all(tag):
        name = element.attributes.get("name", "")
        if not name:
            raise ModelError(source, element.line, f"a <{tag}> without a name", 'give it name="..."')
        if name in found:
            raise ModelError(source, element.line, f"a second <{tag}> '{name}'", "names must differ")
        found[name] = element
    return found


def _lint_joint(joint: Element, links: dict[str, Element], source: str) -> str:
    name, kind = joint.attributes["name"], joint.attributes.get("type", "")
    if kind not in (*MOVING, "fixed"):
        raise ModelError(
            source, joint.line, f"joint '{name}' has type '{kind}'", f"use one of {', '.join(MOVING)}, fixed"
        )
    ends = []
    for end in ("parent", "child"):
        element = joint.child(end)
        link = element.attributes.get("link", "") if element else ""
        if link not in links:
            raise ModelError(
                source, joint.line, f"joint '{name}': {end} link '{link}' does not exist", "name a link"
            )
        ends.append(link)
    if kind in MOVING:
        _lint_axis(joint, name, source)
        _lint_limits(joint, name, kind, source)
    return ends[1]


def _lint_axis(joint: Element, name: str, source: str) -> None:
    axis = joint.child("axis")
    if axis is None:
        return  # URDF's default axis is (1, 0, 0)
    vector = _numbers(axis, "xyz", 3, source)
    if abs(np.linalg.norm(vector) - 1.0) > 1e-3:
        raise ModelError(
            source,
            axis.line,
            f"joint '{name}': the axis has length {np.linalg.norm(vector):g}",
            "give a unit vector",
        )


def _lint_limits(joint: Element, name: str, kind: str, source: str) -> None:
    limit = joint.child("limit")
    if limit is None:
        raise ModelError(
            source, joint.line, f"joint '{name}' has no <limit>",
            "give lower, upper, velocity and effort; without them pinocchio assumes zero",
        )  # fmt: skip
    unit = "m" if kind == "prismatic" else "rad"
    for attribute, what in (("velocity", f"{unit}/s"), ("effort", "N or N m")):
        (value,) = _numbers(limit, attribute, 1, source)
        if value <= 0.0:
            raise ModelError(
                source,
                limit.line,
                f"joint '{name}': {attribute} = {value:g}",
                f"give a positive {attribute} [{what}]",
            )
    if kind == "continuous":
        return
    (lower,), (upper,) = _numbers(limit, "lower", 1, source), _numbers(limit, "upper", 1, source)
    if lower >= upper:
        raise ModelError(
            source,
            limit.line,
            f"joint '{name}': lower = {lower:g} is not below upper = {upper:g}",
            "swap or mend them",
        )
    if kind == "revolute" and max(abs(lower), abs(upper)) > 2.0 * pi + 1e-6:
        raise ModelError(
            source, limit.line, f"joint '{name}': limits {lower:g} to {upper:g} rad exceed a full turn",
            "URDF wants radians, these look like degrees; a joint without limits has type 'continuous'",
        )  # fmt: skip


def _lint_inertial(link: Element, source: str) -> None:
    body = link.child("inertial")
    if body is None:
        return
    name = link.attributes["name"]
    mass_element, inertia = body.child("mass"), body.child("inertia")
    if mass_element is None or inertia is None:
        raise ModelError(source, body.line, f"link '{name}': <inertial> lacks mass or inertia", "give both")
    (mass,) = _numbers(mass_element, "value", 1, source)
    if mass <= 0.0:
        raise ModelError(
            source, mass_element.line, f"link '{name}': mass = {mass:g} kg", "give a positive mass"
        )
    inertia_matrix = np.zeros((3, 3))
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        (value,) = _numbers(inertia, f"i{'xyz'[i]}{'xyz'[j]}", 1, source)
        inertia_matrix[i, j] = inertia_matrix[j, i] = value
    moments = np.linalg.eigvalsh(inertia_matrix)
    if moments[0] <= 0.0 or moments[0] + moments[1] < moments[2] * (1.0 - 1e-6):
        raise ModelError(
            source,
            inertia.line,
            f"link '{name}': moments {', '.join(f'{m:g}' for m in moments)} belong to no rigid body",
            "all must be positive and none above the sum of the others",
        )


def _lint_meshes(link: Element, source: str) -> None:
    for shape in (*link.all("visual"), *link.all("collision")):
        geometry = shape.child("geometry")
        mesh = geometry.child("mesh") if geometry else None
        filename = mesh.attributes.get("filename", "") if mesh else ""
        if mesh and (filename.startswith("/") or "://" in filename or ".." in filename.split("/")):
            raise ModelError(
                source,
                mesh.line,
                f"mesh '{filename}' lies outside the description's folder",
                "use a relative path",
            )


def _require_moving_mass(links: dict[str, Element], joints: dict[str, Element], source: str) -> None:
    """Every moving joint must carry some mass: a massless one has no finite acceleration."""
    carried: dict[str, list[tuple[str, str]]] = {}
    for joint in joints.values():
        parent, child = joint.child("parent"), joint.child("child")
        assert parent is not None and child is not None
        carried.setdefault(parent.attributes["link"], []).append(
            (child.attributes["link"], joint.attributes["type"])
        )

    def rigid_mass(link: str) -> bool:
        if links[link].child("inertial") is not None:
            return True
        return any(rigid_mass(child) for child, kind in carried.get(link, []) if kind == "fixed")

    for joint in joints.values():
        if joint.attributes["type"] == "fixed":
            continue
        child = joint.child("child")
        assert child is not None
        if not rigid_mass(child.attributes["link"]):
            raise ModelError(
                source, joint.line, f"joint '{joint.attributes['name']}' moves a link without mass",
                "give its child link an <inertial>",
            )  # fmt: skip


def _numbers(element: Element, attribute: str, count: int, source: str) -> list[float]:
    text = element.attributes.get(attribute)
    if text is None:
        raise ModelError(
            source, element.line, f"<{element.tag}> lacks '{attribute}'", f'give {attribute}="..."'
        )
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(isfinite, values)):
        raise ModelError(
            source, element.line, f"<{element.tag} {attribute}=\"{text}\">",
            f"give {count} finite number{'s' if count > 1 else ''}",
        )  # fmt: skip
    return values
