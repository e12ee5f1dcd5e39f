"""What is wrong with the bodies of a configuration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import dist, hypot

import numpy as np

from .bodies import shape
from .config import RhiAssist, RhiBody, RhiBox, RhiPlane, RhiResist, RhiSolid, RhiTissue
from .placed import surface_of, turns
from .shapes import Shape
from .surface import SolidError

Found = list[tuple[str, str, str]]
SHORTEST = 1e-3
"""Length of a direction."""
EDGE_SHARE = 0.125
"""Part of a box's least side that may be round: beyond, it has no sides left."""
MOST = 16
"""Bodies: each takes its time in every tick."""
ROUNDING = 1e-9
"""Of depths [m]."""


def body_lengths(bodies: Mapping[str, RhiBody], m: int) -> Iterator[tuple[str, int, int]]:
    """Key, how many numbers it holds, and how many the task's m directions want."""
    for name, body in bodies.items():
        at = f"rhi.bodies.{name}"
        if not isinstance(body, RhiSolid):
            yield f"{at}.point", len(body.point), m
        if isinstance(body, RhiPlane):
            yield f"{at}.normal", len(body.normal), m
        if isinstance(body, RhiBox):
            yield f"{at}.size", len(body.size), m
            if body.turn is not None:
                yield f"{at}.turn", len(body.turn), turns(m)
        if isinstance(body, RhiSolid):
            if body.point is not None:
                yield f"{at}.point", len(body.point), m
            if body.turn is not None:
                yield f"{at}.turn", len(body.turn), turns(m)
            for k, vertex in enumerate(body.vertices or ()):
                yield f"{at}.vertices[{k}]", len(vertex), m
        if isinstance(body, RhiTissue):
            for k, spot in enumerate(body.spots or ()):
                yield f"{at}.spots[{k}].point", len(spot.point), m


def check_bodies(bodies: Mapping[str, RhiBody]) -> Found:
    """Bodies that cannot be rendered; their numbers are as many as the task wants."""
    if not 0 < len(bodies) <= MOST:
        return [("rhi.bodies", f"holds {len(bodies)} bodies", f"give 1 to {MOST}")]
    return [found for name, body in bodies.items() for found in _check(f"rhi.bodies.{name}", body)]


def _check(at: str, body: RhiBody) -> Found:
    if isinstance(body, RhiAssist | RhiResist):
        return []
    if isinstance(body, RhiPlane) and hypot(*body.normal) < SHORTEST:
        return [(f"{at}.normal", "has no length", "give the direction into the wall")]
    if isinstance(body, RhiBox) and body.edge > EDGE_SHARE * min(body.size):
        problem = f"{body.edge:g} m is more than an eighth of the least side of {min(body.size):g} m"
        return [(f"{at}.edge", problem, "give less, or a larger box")]
    if isinstance(body, RhiSolid) and body.vertices and len(body.vertices[0]) not in (2, 3):
        return [(f"{at}.vertices", "stand in one direction", "let the task have two or three")]
    try:
        built = shape(body)
    except SolidError as error:
        if isinstance(body, RhiSolid) and body.mesh is not None:
            return [(f"{at}.mesh", f'"{body.mesh}" {error.problem}', error.fix)]
        return [(at, error.problem, error.fix)]
    return _layers(at, body, built) + _spots(at, body, built)


def _layers(at: str, body: RhiTissue, built: Shape) -> Found:
    """Layers that begin or end where the body is over: what is below them could never be felt."""
    depth, thickness = built.deepest, sum(layer.thickness for layer in body.layers or ())
    if thickness <= depth + ROUNDING:
        return []
    problem = f"are {thickness:g} m deep, and nothing in the body is deeper than {depth:.3g} m"
    return [(f"{at}.layers", problem, "make them thinner, or the body larger")]


def _spots(at: str, body: RhiTissue, built: Shape) -> Found:
    """Spots that are nowhere in their body."""
    found: Found = []
    for k, spot in enumerate(body.spots or ()):
        far = away(body, built, spot.point)
        if far > spot.radius + ROUNDING:
            problem = f"ends {far - spot.radius:.3g} m away from the body, which it would be felt in"
            found.append((f"{at}.spots[{k}].point", problem, "move it into the body, or widen its radius"))
    return found


def away(body: RhiTissue, built: Shape, point: Sequence[float]) -> float:
    """How far a place is from a body, at least [m]; a solid's grid knows nothing of what is far away."""
    if not isinstance(body, RhiSolid):
        return max(0.0, -built.depth(point)[0])
    corners = surface_of(body).places
    return dist(point, np.clip(point, corners.min(axis=0), corners.max(axis=0)).tolist())
