"""Which nodes a mesh encloses, against the solid angle that it covers seen from each of them."""

import numpy as np
import pytest
from hapticd.machines.rhi.enclosed import enclosed
from hapticd.machines.rhi.solid import _to_triangles, solid
from hapticd.machines.rhi.surface import SolidError

from . import meshes

CELL = 8e-3
AT_THE_SURFACE = 1e-9
"""There rounding decides, and the depth is nothing [m]."""


def turns(nodes: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """How often triangles (t, 3, 3) turn round each node: their solid angles over the whole."""
    total = np.zeros(len(nodes))
    for triangle in corners:
        a, b, c = (corner - nodes for corner in triangle)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.sum(a * np.cross(b, c), axis=1)
        against = la * lb * lc + lc * np.sum(a * b, axis=1) + la * np.sum(b * c, axis=1)
        total += 2.0 * np.arctan2(volume, against + lb * np.sum(a * c, axis=1))
    return total / (4.0 * np.pi)


def judge(seed: int) -> tuple[int, int]:
    """Nodes of a mesh's grid that are inside, and those round which it turns otherwise than is found."""
    vertices, faces = meshes.any_mesh(seed)
    low, high = vertices.min(axis=0) - 3 * CELL, vertices.max(axis=0) + 3 * CELL
    axes = [np.arange(a, b, CELL) for a, b in zip(low, high, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    wanted, found = turns(nodes, vertices[faces]), enclosed(axes, vertices, faces).ravel()
    wrong = np.abs(found - wanted) > 0.5
    wrong[wrong] = _to_triangles(nodes[wrong], vertices, faces) > AT_THE_SURFACE
    return int(np.count_nonzero(found)), int(wrong.sum())


@pytest.mark.parametrize("seed", range(7000, 7020))
def test_a_node_is_inside_where_the_surface_turns_round_it(seed: int) -> None:
    inside, wrong = judge(seed)
    assert inside > 10
    assert wrong == 0


def with_slivers(rng: np.random.Generator, mesh: meshes.Mesh, height: float) -> meshes.Mesh:
    """The same surface, with triangles of hardly any height at edges that others divide."""
    vertices, faces = list(mesh[0]), mesh[1].tolist()
    for k in rng.choice(len(faces), min(8, len(faces)), replace=False):
        a, b, c = faces[k]
        aside = height * rng.standard_normal(3)
        vertices.append(vertices[a] + rng.uniform(0.1, 0.9) * (vertices[b] - vertices[a]) + aside)
        m = len(vertices) - 1
        faces[k] = (a, m, c)
        faces += [(m, b, c), (a, b, m)]
    return np.array(vertices), np.array(faces)


@pytest.mark.parametrize("height", [0.0, 1e-17, 1e-12, 1e-9, 1e-8, 1e-6])
def test_triangles_without_a_height_change_nothing(height: float) -> None:
    """To coal alone such a one was up to centimetres away."""
    for seed in range(7100, 7106):
        rng = np.random.default_rng(seed)
        vertices, faces = meshes.any_mesh(seed)
        plain, thin = solid(vertices, faces, CELL), solid(*with_slivers(rng, (vertices, faces), height), CELL)
        if plain._depths.shape == thin._depths.shape:
            off = np.abs(plain._depths - thin._depths).max()
            assert off <= 10.0 * height + 2e-9 + np.abs(np.subtract(plain._origin, thin._origin)).max(), seed


def test_a_shell_that_is_inside_out_is_a_cavity() -> None:
    vertices, faces = meshes.ball(2, 0.06)
    hollow = solid(*meshes.together((vertices, faces), (0.5 * vertices, faces[:, ::-1])), 4e-3)
    assert hollow.depth([0.0, 0.0, 0.0])[0] < -0.02
    assert hollow.depth([0.045, 0.0, 0.0])[0] == pytest.approx(0.0145, abs=2e-3)


def test_shells_in_each_other_are_refused_and_beside_each_other_are_not() -> None:
    """A hand that goes deeper into two such balls would come to a wall of one in the middle of the other."""
    ball = meshes.ball(2, 0.06)
    for aside, fits in ((0.03, False), (0.118, True), (0.13, True)):
        both = meshes.together(ball, (ball[0] + np.array((aside, 0.0, 0.0)), ball[1]))
        if fits:
            assert solid(*both, CELL).deepest > 0.04
            continue
        with pytest.raises(SolidError, match=r"parts that are in each other, at 0\.0\d+ .* unite them"):
            solid(*both, CELL)
