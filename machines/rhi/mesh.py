"""Meshes as people have them: STL or OBJ files, whose coordinates have no unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...models import Array
from ...runtime.configuration.beside import UnfitFileError
from .obj import read_obj
from .stl import read_stl
from .surface import Triangles

MOST_BYTES = 16 << 20
"""Of a file: more than MOST_TRIANGLES have as text."""
MOST_TRIANGLES = 25_000
"""A recording can hold them as text."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """Vertices, none of which is there twice, and triangles of them.

    Attributes:
        vertices: (k, 3), numbers of single precision in the file's unit.
        triangles: (t, 3).
    """

    vertices: Array
    triangles: Triangles

    def called(self, vertex: int) -> str:
        """A vertex by its place, as the program that made the file shows it."""
        return f"({' '.join(f'{x:.6g}' for x in self.vertices[vertex])})"


def read_mesh(name: str, content: bytes) -> Mesh:
    """What a file holds.

    Args:
        name: of the file; its end says what it is.
        content: of the file.

    Raises:
        UnfitFileError: it is damaged, is neither STL nor OBJ, holds no triangle, or too many.
    """
    kind = name.rpartition(".")[2].lower()
    if kind not in ("stl", "obj"):
        raise UnfitFileError("is neither STL nor OBJ", 'save it as one of them, ".stl" or ".obj"')
    corners = (read_stl if kind == "stl" else read_obj)(content)
    if len(corners) > MOST_TRIANGLES:
        problem = f"has {len(corners)} triangles; the most are {MOST_TRIANGLES}"
        raise UnfitFileError(problem, 'simplify it ("decimate", "remesh")')
    return _merged(corners)


def _merged(corners: Array) -> Mesh:
    """Of triangles (t, 3, 3), as STL files have them one by one; those without an extent are left out."""
    with np.errstate(over="ignore"):
        single = corners.astype(np.float32) + np.float32(0.0)  # no -0 beside 0
    if not np.isfinite(single).all():
        first = int(np.flatnonzero(~np.isfinite(single).all(axis=(1, 2)))[0]) + 1
        raise UnfitFileError(f"has a corner of triangle {first} that is no number", "export it anew")
    vertices, which = np.unique(single.reshape(-1, 3), axis=0, return_inverse=True)
    triangles = which.reshape(-1, 3)
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    if not len(triangles):
        raise UnfitFileError("holds no triangles that have an extent", "export a closed surface")
    used, which = np.unique(triangles, return_inverse=True)
    return Mesh(vertices[used].astype(float), which.reshape(-1, 3))
