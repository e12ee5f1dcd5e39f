"""What a solid is said to be made of: one thing, and all that this needs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from .config import RhiBody, RhiSolid

Found = list[tuple[str, str, str]]
SPACE = 3
"""Directions in which triangles enclose something."""


def check_solids(bodies: Mapping[str, RhiBody], m: int) -> Found:
    """Solids of a task with m directions that are made of nothing, of two things, or of another task's."""
    return [
        (f"rhi.bodies.{name}{key}", problem, fix)
        for name, body in bodies.items()
        if isinstance(body, RhiSolid)
        for key, problem, fix in (_written(body) if body.mesh is None else _meshed(body, m))
    ]


def _written(body: RhiSolid) -> Iterator[tuple[str, str, str]]:
    if body.vertices is None:
        yield "", "has neither vertices nor a mesh", 'give vertices, or a file: mesh = "organ.stl"'
        return
    if body.unit is not None or body.scale != 1.0:
        key = ".unit" if body.unit is not None else ".scale"
        yield key, "is that of a mesh, and there is none", "remove it; vertices have units of their own"
    if body.kept is not None:
        yield ".kept", "belongs to no file", "name the file as mesh, and remove this table"


def _meshed(body: RhiSolid, m: int) -> Iterator[tuple[str, str, str]]:
    for key, given in (("vertices", body.vertices), ("triangles", body.triangles)):
        if given is not None:
            yield f".{key}", f'says again what "{body.mesh}" says', "keep one of them"
    if m != SPACE:
        problem = f'"{body.mesh}" is a mesh in space, and the task has {m} directions'
        yield ".mesh", problem, "give the corners of an outline instead, as vertices"
    if body.unit is None:
        yield ".unit", f'is missing: "{body.mesh}" says none itself', 'add it, e.g. unit = "mm"'
    if body.kept is None:
        yield ".mesh", f'"{body.mesh}" was not read', "load the configuration from its file"
