"""Which nodes of a grid are enclosed by a closed surface of triangles, and how often.

Along each line of nodes the crossings of the surface are counted with their signs: beyond all of them the
number of turns is 0, so at a node it is what is crossed from there on. A line that meets an edge or a vertex
is no special case: whether a row is below a vertex is compared once for each of them, and where an edge
crosses a row is computed from its two ends in one order, so that both of its triangles agree to the last bit.
A node is on the wrong side only where rounding is larger than its distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...models import Array
from .surface import Triangles

AT_ONCE = 4_000_000
"""Lines times triangles that are looked at together: some hundred megabytes."""


def enclosed(axes: Sequence[Array], vertices: Array, triangles: Triangles) -> NDArray[np.int64]:
    """How often the surface turns round each node; one that is inside out does so in the other direction.

    Args:
        axes: places of the nodes along each of three directions, rising [m].
        vertices: (k, 3) [m].
        triangles: (t, 3); each edge is gone along as often one way as the other.

    Returns:
        Of the shape of the grid.
    """
    order = np.argsort([len(axis) for axis in axes], kind="stable")  # lines along most nodes are fewest
    x, y, z = (axes[i] for i in order)
    turned = vertices[:, order]
    over = np.zeros((len(x), len(y), len(z) + 1), int)
    each = max(1, AT_ONCE // (len(x) * len(y)))
    for first in range(0, len(triangles), each):
        _count(over, (x, y, z), turned, triangles[first : first + each])
    turns = np.cumsum(over[..., ::-1], axis=-1)[..., -2::-1]
    handed = round(np.linalg.det(np.eye(3)[order]))
    return np.ascontiguousarray(handed * np.transpose(turns, np.argsort(order)))


@dataclass(frozen=True, slots=True)
class _Edges:
    """Directed edges over rows, one a row: where they are there."""

    x: Array
    z: Array
    columns: NDArray[np.int64]


def _count(
    over: NDArray[np.int64], axes: tuple[Array, Array, Array], vertices: Array, triangles: Triangles
) -> None:
    """Adds the crossings of some triangles: [i, j, k] is those between nodes k - 1 and k of a line."""
    x, y, z = axes
    below = np.searchsorted(y, vertices[:, 1], side="right")  # rows below each vertex
    corners = below[triangles]
    which, row = _each(corners.min(axis=1), corners.max(axis=1))
    up, down = (_at_rows(axes, vertices, triangles[which], below, row, way) for way in (1, -1))
    line, column = _each(np.minimum(up.columns, down.columns), np.maximum(up.columns, down.columns))
    along = (x[column] - down.x[line]) / (up.x[line] - down.x[line])
    height = down.z[line] + along * (up.z[line] - down.z[line])
    sign = np.sign(up.columns - down.columns)[line]
    np.add.at(over, (column, row[line], np.searchsorted(z, height, side="left")), sign)


def _each(first: NDArray[np.int64], last: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All numbers of ranges that end before their last one, and which range each is of."""
    counts = last - first
    which = np.repeat(np.arange(len(counts)), counts)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts - first, counts)


def _at_rows(
    axes: tuple[Array, Array, Array],
    vertices: Array,
    triangles: Triangles,
    below: NDArray[np.int64],
    row: NDArray[np.int64],
    way: int,
) -> _Edges:
    """Of triangles (k, 3) and a row of each the edge that goes over it upwards, or with -1 downwards."""
    begin, end = (triangles, np.roll(triangles, -1, axis=1))[::way]
    crosses = (below[begin] <= row[:, None]) & (row[:, None] < below[end])
    edge = crosses.argmax(axis=1)[:, None]
    ends = [np.take_along_axis(side, edge, axis=1)[:, 0] for side in (begin, end)]
    a, b = vertices[np.minimum(*ends)], vertices[np.maximum(*ends)]
    share = (axes[1][row] - a[:, 1]) / (b[:, 1] - a[:, 1])
    x = a[:, 0] + share * (b[:, 0] - a[:, 0])
    z = a[:, 2] + share * (b[:, 2] - a[:, 2])
    return _Edges(x, z, np.searchsorted(axes[0], x, side="right"))
