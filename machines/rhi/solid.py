"""Depths in a body that its surface gives: a closed outline in a plane, or closed triangles in space."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import coal
import numpy as np
from numpy.typing import NDArray

from ...models import Array
from .enclosed import enclosed
from .shapes import Sampled
from .surface import SolidError, Triangles, numbered, require_closed

MARGIN = 3
"""Nodes of the grid around the body, on each side."""
THINNEST = 1e-9
"""Height of a triangle that counts [m]."""
MOST_NODES = 300_000
"""Of a grid: a second or two of work, and no more memory than a picture has."""


def solid(
    vertices: Array,
    triangles: Sequence[Sequence[int]] | Triangles,
    cell: float,
    called: Callable[[int], str] = numbered,
) -> Sampled:
    """The depth in a solid.

    Args:
        vertices: (k, m) [m]; with m = 2 the corners of an outline in their order.
        triangles: with m = 3 of vertices, from 0; each edge belongs to two of them.
        cell: distance of the nodes at which depths are computed [m].
        called: tells people which vertex one is.

    Raises:
        SolidError: the surface is not closed, passes through itself, encloses nothing, or would need too many
            nodes.
    """
    places = np.asarray(vertices, float)
    low, high = places.min(axis=0), places.max(axis=0)
    size = " x ".join(f"{x:.3g}" for x in high - low)
    wanted = np.ceil((high - low) / cell) + 1 + 2 * MARGIN
    if not np.prod(wanted) <= MOST_NODES:
        problem = f"needs {np.prod(wanted):.0f} nodes; the most are {MOST_NODES}: it is {size} m in size"
        raise SolidError(problem, f"give a larger cell than {cell:g} m, or another size")
    counts = wanted.astype(int)
    origin = low - MARGIN * cell
    axes = [o + cell * np.arange(n) for o, n in zip(origin, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(counts))
    if len(counts) == 2:
        away, inside = _to_outline(nodes, places), np.abs(_turns(nodes, places)) > 0.5
    else:
        faces = np.asarray(triangles, int).reshape(-1, 3)
        require_closed(faces, len(places), called)
        turns = enclosed(axes, places, faces).ravel()
        inside = turns != 0
        away = _to_triangles(nodes, places, faces) if inside.any() else np.empty(0)
        _require_apart(nodes, away, turns, cell)
    if not inside.any():
        problem = f"encloses nothing that is thicker than a cell: it is {size} m in size"
        raise SolidError(problem, f"give a smaller cell than {cell:g} m, or a larger body")
    return Sampled(origin.tolist(), cell, np.where(inside, away, -away).reshape(counts))


def _require_apart(nodes: Array, away: Array, turns: NDArray[np.int64], cell: float) -> None:
    """No two parts of a surface are in each other: depths would count from walls that are inside."""
    twice = np.flatnonzero(np.abs(turns) > 1)
    if len(twice) and away[twice].max() > cell:
        deepest = twice[int(away[twice].argmax())]
        where = " ".join(f"{x:.3g}" for x in nodes[deepest])
        raise SolidError(f"has parts that are in each other, at {where} m", 'unite them ("boolean union")')


def _to_outline(nodes: Array, corners: Array) -> Array:
    """Distance of nodes (k, 2) to the closed outline, (k,)."""
    nearest = np.full(len(nodes), np.inf)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = b - a
        along = np.clip((nodes - a) @ side / max(float(side @ side), 1e-300), 0.0, 1.0)
        np.minimum(nearest, np.linalg.norm(nodes - a - along[:, None] * side, axis=1), out=nearest)
    return nearest


def _turns(nodes: Array, corners: Array) -> Array:
    """How often the outline turns round each node, (k,)."""
    total = np.zeros(len(nodes))
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        u, v = a - nodes, b - nodes
        total += np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], np.sum(u * v, axis=1))
    turns: Array = total / (2.0 * np.pi)
    return turns


def _to_triangles(nodes: Array, vertices: Array, faces: Triangles) -> Array:
    """Distance of nodes (k, 3) to the surface, (k,).

    To triangles without a height coal finds any distances; all of such a one is on its longest side, which
    is another's, too.
    """
    corners = vertices[faces]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    twice = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    corners = corners[twice > THINNEST * sides]
    surface = coal.BVHModelOBBRSS()
    surface.beginModel(len(corners), 3 * len(corners))
    for triangle in corners:
        surface.addTriangle(*triangle)
    surface.endModel()
    probe, still = coal.Sphere(0.0), coal.Transform3s()
    request, result, at = coal.DistanceRequest(), coal.DistanceResult(), coal.Transform3s()
    away = np.empty(len(nodes))
    for k, node in enumerate(nodes):
        at.setTranslation(node)
        result.clear()
        away[k] = abs(coal.distance(surface, still, probe, at, request, result))
    return away
