"""STL files, binary and ASCII: triangles one by one, each with its three corners."""

from __future__ import annotations

import numpy as np

from ...models import Array
from ...runtime.configuration.beside import UnfitFileError
from .numbers import numbers

HEAD, RECORD = 84, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""Bytes before the triangles, of which the last four are their number; a triangle."""
AGAIN = "export it anew"
AROUND = (b"solid", b"facet", b"outer", b"endfacet", b"endsolid")
"""Words of a text that say nothing but where a triangle begins and ends."""


def read_stl(content: bytes) -> Array:
    """Corners of the triangles, (t, 3, 3).

    Raises:
        UnfitFileError: the file is damaged, or is no STL.
    """
    count = int.from_bytes(content[HEAD - 4 : HEAD], "little")
    if len(content) >= HEAD and len(content) == HEAD + count * RECORD.itemsize:
        return np.asarray(np.frombuffer(content, RECORD, count, HEAD)["corners"], float)
    if content[:1000].lstrip().lower().startswith(b"solid") and b"\0" not in content[:1000]:
        return _of_text(content)
    problem = f"has {len(content)} bytes, and a binary STL of the {count} triangles that it speaks of"
    raise UnfitFileError(f"{problem} has {HEAD + count * RECORD.itemsize}: it is damaged, or no STL", AGAIN)


def _of_text(content: bytes) -> Array:
    triangles: list[list[list[float]]] = []
    loop: list[list[float]] = []
    for number, line in enumerate(content.splitlines(), 1):
        words = line.split()
        word = words[0].lower() if words else b""
        if word == b"vertex":
            loop.append(numbers(words[1:], 3, 3, number))
        elif word == b"endloop":
            if len(loop) != 3:
                raise UnfitFileError(f"has a loop of {len(loop)} corners in its line {number}", AGAIN)
            triangles.append(loop)
            loop = []
        elif word and word not in AROUND:
            told = word[:20].decode("ascii", "replace")
            raise UnfitFileError(f"holds '{told}' in its line {number}, which no STL does", AGAIN)
    if loop or not content.rstrip().splitlines()[-1].lstrip().lower().startswith(b"endsolid"):
        raise UnfitFileError('ends before its "endsolid"', f"it is cut short: {AGAIN}")
    return np.array(triangles, float).reshape(-1, 3, 3)
