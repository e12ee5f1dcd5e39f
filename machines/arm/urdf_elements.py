"""What the elements of a URDF say."""

from __future__ import annotations

from math import inf, isfinite

import numpy as np
import pinocchio as pin

from ...configs.numerals import number
from ...configs.ranges import RANGES
from ...models.xml_tree import Element
from .description import MOVING, Body, Joint, Primitive
from .errors import InitError

SMALLEST, LARGEST = RANGES["size"].lower, RANGES["size"].upper
LEAST_MASS = 1e-3
"""Of a link that moves: less is taken for nothing [kg]."""


def name_of(element: Element, source: str) -> str:
    """The name of a link or joint.

    Raises:
        InitError: it has none.
    """
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


def body_of(link: Element, source: str) -> Body | None:
    """The body of a link; None where it has no mass to speak of.

    Raises:
        InitError: what should be a number is none.
    """
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


def primitives_of(link: Element, source: str) -> list[Primitive]:
    """Collision shapes of a link that are no meshes; what has no size is none.

    Raises:
        InitError: what should be a number is none.
    """
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


def joint_of(element: Element, source: str) -> Joint:
    """A joint, whatever moves it.

    Raises:
        InitError: its kind, its axis or an end of it is not there, or what should be a number is none.
    """
    name, kind = name_of(element, source), element.attributes.get("type", "")
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
