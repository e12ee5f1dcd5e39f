"""What is wrong with the bodies of a configuration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot

from .bodies import environment, turns
from .config import RhiBody, RhiBox, RhiPlane, RhiSolid, RhiTissue
from .solid import SolidError

Found = list[tuple[str, str, str]]
SHORTEST = 1e-3
"""Length of a direction."""
EDGE_SHARE = 0.125
"""Part of a box's least side that may be round: beyond, it has no sides left."""
MOST = 16
"""Bodies: each takes its time in every tick."""


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
            for k, vertex in enumerate(body.vertices):
                yield f"{at}.vertices[{k}]", len(vertex), m
        if isinstance(body, RhiTissue):
            for k, spot in enumerate(body.spots or ()):
                yield f"{at}.spots[{k}].point", len(spot.point), m


def check_bodies(bodies: Mapping[str, RhiBody]) -> Found:
    """Bodies that cannot be rendered; their numbers are as many as the task wants."""
    if not 0 < len(bodies) <= MOST:
        return [("rhi.bodies", f"holds {len(bodies)} bodies", f"give 1 to {MOST}")]
    found: Found = []
    for name, body in bodies.items():
        at = f"rhi.bodies.{name}"
        if isinstance(body, RhiPlane) and hypot(*body.normal) < SHORTEST:
            found.append((f"{at}.normal", "has no length", "give the direction into the wall"))
        elif isinstance(body, RhiBox) and body.edge > EDGE_SHARE * min(body.size):
            problem = f"{body.edge:g} m is more than an eighth of the least side"
            found.append((f"{at}.edge", problem, "give less, or a larger box"))
        elif isinstance(body, RhiSolid):
            if len(body.vertices[0]) not in (2, 3):
                found.append((f"{at}.vertices", "stand in one direction", "let the task have two or three"))
                continue
            try:
                environment({name: body})
            except SolidError as error:
                found.append((at, str(error), "mend vertices and triangles, or give a larger cell"))
    return found
