"""Depths in a body that its surface gives: a closed outline in a plane, or closed triangles in space."""

from __future__ import annotations

from collections.abc import Sequence

import coal
import numpy as np
from numpy.typing import NDArray

from ...models import Array
from .shapes import Sampled

MARGIN = 3
"""Nodes of the grid around the body, on each side."""
MOST_NODES = 300_000
"""Of a grid: a second or two of work, and no more memory than a picture has."""


class SolidError(ValueError):
    """No body has this surface; the message says why."""


def solid(vertices: Array, triangles: Sequence[Sequence[int]], cell: float) -> Sampled:
    """The depth in a solid.

    Args:
        vertices: (k, m) [m]; with m = 2 the corners of an outline in their order.
        triangles: with m = 3 of vertices, from 0; each edge belongs to two of them.
        cell: distance of the nodes at which depths are computed [m].

    Raises:
        SolidError: the surface is not closed, encloses nothing, or would need too many nodes.
    """
    places = np.asarray(vertices, float)
    low, high = places.min(axis=0), places.max(axis=0)
    counts = np.ceil((high - low) / cell).astype(int) + 1 + 2 * MARGIN
    if np.prod(counts.astype(float)) > MOST_NODES:
        raise SolidError(f"needs {np.prod(counts.astype(float)):.0f} nodes; the most are {MOST_NODES}")
    origin = low - MARGIN * cell
    axes = [o + cell * np.arange(n) for o, n in zip(origin, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(counts))
    if len(counts) == 2:
        away, turns = _to_outline(nodes, places), _turns(nodes, places)
    else:
        faces = _closed(np.asarray(triangles, int).reshape(-1, 3), len(places))
        away, turns = _to_triangles(nodes, places, faces), _solid_turns(nodes, places[faces])
    inside = np.abs(turns) > 0.5
    if not inside.any():
        raise SolidError("encloses nothing that is thicker than a cell")
    return Sampled(origin.tolist(), cell, np.where(inside, away, -away).reshape(counts))


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


def _closed(faces: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """The triangles, if they enclose something."""
    if not len(faces) or faces.min() < 0 or faces.max() >= count:
        raise SolidError(f"needs triangles of vertices from 0 to {count - 1}")
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).tolist()
    if len(set(map(tuple, edges))) < len(edges) or {(b, a) for a, b in edges} != set(map(tuple, edges)):
        raise SolidError("is not closed, or its triangles do not all turn the same way")
    return faces


def _to_triangles(nodes: Array, vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Distance of nodes (k, 3) to the surface, (k,)."""
    surface = coal.BVHModelOBBRSS()
    surface.beginModel(len(faces), 3 * len(faces))
    for corners in vertices[faces]:
        surface.addTriangle(*corners)
    surface.endModel()
    probe, still = coal.Sphere(0.0), coal.Transform3s()
    request, result, at = coal.DistanceRequest(), coal.DistanceResult(), coal.Transform3s()
    away = np.empty(len(nodes))
    for k, node in enumerate(nodes):
        at.setTranslation(node)
        result.clear()
        away[k] = abs(coal.distance(surface, still, probe, at, request, result))
    return away


def _solid_turns(nodes: Array, corners: Array) -> Array:
    """Solid angle of closed triangles (t, 3, 3) round each node over the whole, (k,)."""
    total = np.zeros(len(nodes))
    for triangle in corners:
        a, b, c = (corner - nodes for corner in triangle)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.sum(a * np.cross(b, c), axis=1)
        against = la * lb * lc + lc * np.sum(a * b, axis=1) + la * np.sum(b * c, axis=1)
        against += lb * np.sum(a * c, axis=1)
        total += 2.0 * np.arctan2(volume, against)
    turns: Array = total / (4.0 * np.pi)
    return turns
