"""Closed meshes to try things with, and files of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]
"""Vertices (k, 3) and triangles (t, 3), which turn to the left seen from outside."""


def rolled(rings: int, around: int, place: Callable[[float, float], tuple[float, float, float]]) -> Mesh:
    """A sheet that is closed along both of its angles, as a torus is."""
    vertices = [
        place(2 * np.pi * i / rings, 2 * np.pi * j / around) for i in range(rings) for j in range(around)
    ]
    faces = []
    for i in range(rings):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            c, d = (i + 1) % rings * around + j, (i + 1) % rings * around + (j + 1) % around
            faces += [(a, c, d), (a, d, b)]
    return np.array(vertices), np.array(faces)


def torus(rings: int = 24, around: int = 16, radius: float = 0.06, thickness: float = 0.025) -> Mesh:
    """Round the z axis."""

    def place(u: float, v: float) -> tuple[float, float, float]:
        away = radius + thickness * np.cos(v)
        return away * np.cos(u), away * np.sin(u), thickness * np.sin(v)

    return rolled(rings, around, place)


def ball(times: int = 3, radius: float = 0.05) -> Mesh:
    """An icosahedron whose triangles are each divided into four, some times."""
    t = (1 + 5**0.5) / 2
    corners = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t)]
    corners += [(0, -1, -t), (0, 1, -t), (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    faces += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
    faces += [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    vertices = [np.array(c) / np.linalg.norm(c) for c in corners]
    for _ in range(times):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, known: dict[tuple[int, int], int] = middles) -> int:
            key = min(a, b), max(a, b)
            if key not in known:
                between = vertices[a] + vertices[b]
                vertices.append(between / np.linalg.norm(between))
                known[key] = len(vertices) - 1
            return known[key]

        divided = []
        for a, b, c in faces:
            x, y, z = middle(a, b), middle(b, c), middle(c, a)
            divided += [(a, x, z), (b, y, x), (c, z, y), (x, y, z)]
        faces = divided
    return radius * np.array(vertices), np.array(faces)


def box(size: tuple[float, float, float] = (0.1, 0.08, 0.06)) -> Mesh:
    """Its edges are along the axes."""
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    return (corners - 0.5) * size, np.array(faces)


def star(rng: np.random.Generator, times: int = 2) -> Mesh:
    """A ball whose vertices are at any distances from its middle."""
    vertices, faces = ball(times, 0.06)
    return vertices * rng.uniform(0.3, 1.0, (len(vertices), 1)), faces


def turned(rng: np.random.Generator, mesh: Mesh, far: float = 0.03) -> Mesh:
    """Somewhere else, and any way round."""
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    axes *= np.sign(np.linalg.det(axes))
    return mesh[0] @ axes.T + rng.uniform(-far, far, 3), mesh[1]


def together(*meshes: Mesh) -> Mesh:
    """Several as one, which may overlap."""
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    faces = [faces + first for (_, faces), first in zip(meshes, firsts, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)


def any_mesh(seed: int) -> Mesh:
    """Closed, and of any kind."""
    rng = np.random.default_rng(seed)
    kinds: list[Callable[[], Mesh]] = [
        lambda: ball(int(rng.integers(0, 4))),
        torus,
        box,
        lambda: turned(rng, box()),
        lambda: turned(rng, torus()),
        lambda: star(rng),
        lambda: together(*(turned(rng, star(rng, 1)) for _ in range(3))),
        lambda: together(box(), turned(rng, box()), turned(rng, ball(2))),
        lambda: (lambda mesh: (mesh[0] + rng.normal(0.0, 0.004, mesh[0].shape), mesh[1]))(torus()),
        lambda: (lambda mesh: (np.round(mesh[0] / 4e-3) * 4e-3, mesh[1]))(torus()),  # vertices on nodes
    ]
    vertices, faces = kinds[seed % len(kinds)]()
    return vertices, faces if rng.random() < 0.8 else faces[:, ::-1]


def binary_stl(mesh: Mesh, scale: float = 1e3) -> bytes:
    """In millimetres."""
    corners = (scale * mesh[0][mesh[1]]).astype("<f4")
    records = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["corners"] = corners
    return bytes(80) + len(corners).to_bytes(4, "little") + records.tobytes()


def ascii_stl(mesh: Mesh, scale: float = 1e3) -> bytes:
    """In millimetres, as most programs write it."""
    lines = ["solid of a test"]
    for corners in scale * mesh[0][mesh[1]]:
        vertices = [f"      vertex {x:.9e} {y:.9e} {z:.9e}" for x, y, z in corners]
        lines += ["  facet normal 0 0 0", "    outer loop", *vertices, "    endloop", "  endfacet"]
    return "\n".join([*lines, "endsolid of a test", ""]).encode()


def obj(mesh: Mesh, scale: float = 1e3) -> bytes:
    """In millimetres."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in scale * mesh[0]]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh[1].tolist()]
    return "\n".join(["# of a test", "o thing", *lines, ""]).encode()
