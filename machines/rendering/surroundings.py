"""What a machine could meet: the collision shapes of its model, and what its configuration puts around it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from ...control.look_ahead import MOST_PAIRS, Body, Box, Capsule, Plane, standing
from ...models import Array, Robot
from ...models.shapes import Shape
from .check import Found
from .sections import LookAhead as Section

FLOOR = "the floor"
POSTURES, NEARLY_ALWAYS = 200, 0.95
"""Two shapes that are too near in so many of so many random postures belong together: they tell nothing."""

WRIST = 2
"""Shapes with so many joints between them may always be near: a wrist is built so."""


def capsule(shape: Shape) -> Capsule:
    """The capsule around a shape that moves: a box lies within the one along its longest side."""
    R, centre = shape.T[:3, :3], shape.T[:3, 3]
    along, half, radius = R[:, 2], 0.0, shape.size[0]
    if shape.kind == "box":
        sides = np.array(shape.size) / 2.0
        longest = int(sides.argmax())
        along, half = R[:, longest], float(sides[longest])
        radius = float(np.hypot(*np.delete(sides, longest)))
    elif shape.kind != "sphere":
        half = shape.size[1] / 2.0
    return Capsule(shape.link, shape.joint, centre - half * along, centre + half * along, radius)


def own_bodies(robot: Robot) -> tuple[list[Capsule], list[Body]]:
    """The machine's shapes: what moves, and what stands; meshes are left out."""
    shapes = [shape for shape in robot.shapes if shape.kind != "mesh"]
    moving = [capsule(shape) for shape in shapes if shape.joint >= 0]
    fixed: list[Body] = [
        _box(shape) if shape.kind == "box" else capsule(shape) for shape in shapes if shape.joint < 0
    ]
    return moving, fixed


def _box(shape: Shape) -> Box:
    return Box(shape.link, shape.T[:3, 3], np.array(shape.size) / 2.0, shape.T[:3, :3].copy())


def obstacles(section: Section) -> list[Body]:
    """Floor and boxes around the machine."""
    found: list[Body] = []
    if section.floor is not None:
        found.append(Plane(FLOOR, np.array([0.0, 0.0, section.floor]), np.array([0.0, 0.0, 1.0])))
    for box in section.obstacles or ():
        axes = pin.rpy.rpyToMatrix(*(box.angles or (0.0, 0.0, 0.0)))
        found.append(Box(box.name, np.array(box.centre), np.array(box.size) / 2.0, axes))
    return found


def pairs(robot: Robot, section: Section) -> Iterator[tuple[Capsule, Body]]:
    """All that could meet: links with one joint or none between them cannot."""
    moving, fixed = own_bodies(robot)
    for first in moving:
        yield from ((first, obstacle) for obstacle in obstacles(section))
        yield from ((first, second) for second in fixed if first.joint >= 1)
        yield from ((first, second) for second in moving if first.joint > second.joint + 1)


def check_pairs(robot: Robot, section: Section | None) -> Found:
    """More pairs than can be watched."""
    count = len(list(pairs(robot, section))) if section else 0
    if count <= MOST_PAIRS:
        return []
    problem = f"{count} pairs of shapes could meet, at most {MOST_PAIRS} can be watched"
    return [("look_ahead", problem, "give fewer obstacles, or the links fewer collision shapes")]


def watched(
    robot: Robot, section: Section, limits: tuple[Array, Array]
) -> tuple[list[tuple[Capsule, Body]], list[tuple[Capsule, Body]]]:
    """Pairs to watch, and those that are too near nearly everywhere within limits (n,) [rad or m]."""
    found = list(pairs(robot, section))
    look = standing(robot, found, section.margin)
    low, high = np.maximum(limits[0], -np.pi), np.minimum(limits[1], np.pi)
    postures = np.random.default_rng(0).uniform(low, np.maximum(low, high), (POSTURES, robot.nv))
    near = np.zeros(len(found))
    for q in postures:
        near += look.distances(q) < section.margin
    always = (near > NEARLY_ALWAYS * POSTURES).tolist()
    return (
        [pair for pair, out in zip(found, always, strict=True) if not out],
        [pair for pair, out in zip(found, always, strict=True) if out],
    )


def unwatched(robot: Robot, section: Section | None, limits: tuple[Array, Array]) -> list[str]:
    """What the look-ahead does not see of a machine, for people; lower and upper limits (n,) [rad or m]."""
    if section is None:
        return []
    meshes = sorted({shape.link for shape in robot.shapes if shape.kind == "mesh"})
    found = [f"look_ahead does not see the meshes of {', '.join(meshes)}"] if meshes else []
    pairs, always = watched(robot, section, limits)
    if not pairs:
        found.append("look_ahead sees nothing that could meet: give the links <collision> shapes")
    apart = [
        f"{first.name} and {second.name}"
        for first, second in always
        if not isinstance(second, Capsule) or first.joint - second.joint > WRIST
    ]
    if apart:
        found.append(f"too near nearly everywhere, so look_ahead leaves it out: {', '.join(apart)}")
    return found
