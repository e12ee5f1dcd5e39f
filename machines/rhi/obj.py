"""OBJ files: of all that they may hold, vertices and faces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from ...models import Array
from ...runtime.configuration.beside import UnfitFileError
from .numbers import numbers
from .surface import Triangles

AGAIN = "export it anew"


def read_obj(content: bytes) -> Array:
    """Corners of the triangles that the faces consist of, (t, 3, 3).

    A face of more corners is a fan of triangles about its first. Materials, normals, lines and points do not
    matter here.

    Raises:
        UnfitFileError: a line of vertices or faces makes no sense.
    """
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for number, line in enumerate(content.splitlines(), 1):
        words = line.partition(b"#")[0].split()
        if not words:
            continue
        if words[-1].endswith(b"\\"):
            raise UnfitFileError(f"goes on in another line after its line {number}", "write one line a face")
        if words[0] == b"v":
            vertices.append(numbers(words[1:], 3, 7, number)[:3])  # weights or colours may follow
        elif words[0] == b"f":
            face = [_index(word, len(vertices), number) for word in words[1:]]
            triangles += _fan(face, number)
    places = np.array(vertices, float).reshape(-1, 3)
    return np.asarray(places[np.array(triangles, int).reshape(-1, 3)])


def obj_lines(vertices: Array, triangles: Triangles) -> Iterator[str]:
    """Lines of an OBJ file; coordinates keep all that single precision has."""
    for place in vertices.astype(np.float32):
        yield f"v {' '.join(str(x) for x in place)}"
    for a, b, c in (triangles + 1).tolist():
        yield f"f {a} {b} {c}"


def _fan(face: Sequence[int], line: int) -> Iterator[tuple[int, int, int]]:
    if len(face) < 3:
        raise UnfitFileError(f"has a face of {len(face)} corners in its line {line}", AGAIN)
    for b, c in pairwise(face[1:]):
        yield face[0], b, c


def _index(word: bytes, count: int, line: int) -> int:
    """Of a vertex, from 0; the file counts from 1, or from the last one back, and adds others behind a /."""
    own = word.partition(b"/")[0]
    if own.removeprefix(b"-").isdigit() and len(own) < 10:
        index = int(own)
        if 1 <= index <= count or -count <= index <= -1:
            return index - 1 if index > 0 else count + index
    told = word[:20].decode("ascii", "replace")
    raise UnfitFileError(f"has a corner '{told}' in its line {line}, and {count} vertices before it", AGAIN)
