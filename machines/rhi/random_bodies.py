"""Random bodies for a hand that begins in front of one of them."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin
from random import Random
from typing import Any

import numpy as np

from ...configs.quantities import Angles, Damping, Lengths, Sizes, Stiffness, Thickness
from ...models import Array
from .bodies import environment
from .body_check import check_bodies
from .config import (
    RhiBody,
    RhiBox,
    RhiLayer,
    RhiPlane,
    RhiSolid,
    RhiSphere,
    RhiSpot,
)
from .placed import turns

MOST = 3
"""Bodies at once."""
STIFFNESS, DAMPING = (200.0, 2000.0), (0.0, 5.0)
"""[N/m], [N s/m]."""
SIZE = (0.04, 0.15)
"""Radius, or half a side [m]."""
LAYERED, SPOTTED, DAMPED = 0.3, 0.3, 0.5
"""Share of the bodies."""
LAYER, LAYER_FACTOR = (1e-3, 0.01), (0.2, 3.0)
"""Thickness [m]; of the stiffness below."""
SPOT, SPOT_FACTOR = (0.01, 0.04), (0.2, 4.0)
CORNERS = (5, 9)
"""Of an outline."""
DENT = (0.5, 1.0)
"""Distance of an outline's corners from its middle, as a share of its radius."""
TRIES = 1000


def random_bodies(
    random: Random, point: Array, normal: Array, room: float, hand: Sequence[float]
) -> dict[str, RhiBody]:
    """One to three bodies, none of which holds the hand; the first touches ``point``, behind which it is.

    Args:
        random: draws.
        point: of the first body's surface, (m,) [m].
        normal: into it, of any length (m,).
        room: how far from the point the others are at most, along each direction [m].
        hand: where it begins, (m,) [m].

    Raises:
        ValueError: the hand is always in a body.
    """
    bodies: dict[str, RhiBody] = {}
    inwards = normal / np.linalg.norm(normal)
    for k in range(random.randint(1, MOST)):
        for _ in range(TRIES):
            at, into = point, inwards
            if k:
                at = point + np.array([random.uniform(-room, room) for _ in point])
                into = np.array([random.gauss(0.0, 1.0) for _ in point])
                into = into / np.linalg.norm(into)
            body = _body(random, at, into)
            rendered = environment({"body": body})
            rendered.force(list(hand))
            if rendered.depth == 0.0 and not check_bodies({"body": body}):
                bodies[f"body_{k + 1}"] = body
                break
        else:
            raise ValueError(f"no body leaves the hand at {list(hand)} free in {TRIES} tries")
    return bodies


def _body(random: Random, point: Array, inwards: Array) -> RhiBody:
    """A body of any kind whose surface is at the point or a little behind it."""
    m, size = len(point), random.uniform(*SIZE)
    tissue = _tissue(random, point)
    kinds = ["plane", "sphere", "box", *(["solid"] if m == 2 else [])]
    match random.choice(kinds):
        case "plane":
            return RhiPlane(**tissue, point=Lengths(point.tolist()), normal=tuple(inwards.tolist()))
        case "sphere":
            middle = Lengths((point + size * inwards).tolist())
            return RhiSphere(**tissue, point=middle, radius=Thickness(size))
        case "box":
            sides = Sizes(2.0 * random.uniform(*SIZE) for _ in range(m))
            middle = Lengths((point + 0.5 * float(np.linalg.norm(sides)) * inwards).tolist())
            turn = Angles(random.uniform(-pi, pi) for _ in range(turns(m))) if turns(m) else None
            return RhiBox(**tissue, point=middle, size=sides, turn=turn)
        case _:
            middle = Lengths((point + size * inwards).tolist())
            return RhiSolid(**tissue, vertices=_outline(random, middle, size))


def _outline(random: Random, middle: Sequence[float], radius: float) -> tuple[Lengths, ...]:
    """Corners round a middle: dents and points, but no crossing."""
    count, first = random.randint(*CORNERS), random.uniform(-pi, pi)
    corners = []
    for k in range(count):
        away, angle = radius * random.uniform(*DENT), first + 2.0 * pi * k / count
        corners.append(Lengths((middle[0] + away * cos(angle), middle[1] + away * sin(angle))))
    return tuple(corners)


def _tissue(random: Random, point: Array) -> dict[str, Any]:
    """Fields of a tissue; spots are next to the point."""
    stiffness = _between(random, STIFFNESS)
    found: dict[str, Any] = {"stiffness": Stiffness(stiffness)}
    if random.random() < DAMPED:
        found["damping"] = Damping(random.uniform(*DAMPING))
    if random.random() < LAYERED:
        found["layers"] = tuple(
            RhiLayer(
                Thickness(_between(random, LAYER)), Stiffness(stiffness * _between(random, LAYER_FACTOR))
            )
            for _ in range(random.randint(1, 3))
        )
    if random.random() < SPOTTED:
        place = Lengths(x + random.uniform(-0.03, 0.03) for x in point.tolist())
        found["spots"] = (RhiSpot(place, Thickness(random.uniform(*SPOT)), _between(random, SPOT_FACTOR)),)
    return found


def _between(random: Random, range_: tuple[float, float]) -> float:
    """Every octave is as likely as the others."""
    low, high = range_
    return float(low * (high / low) ** random.random())
