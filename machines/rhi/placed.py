"""Where the surface of a solid is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio as pin

from ...configs.units import DIMENSIONS
from ...models import Array
from ...runtime.configuration.beside import UnfitFileError
from .config import RhiSolid
from .mesh import read_mesh
from .surface import SolidError, Triangles, numbered


@dataclass(frozen=True, slots=True)
class Surface:
    """A surface in space, or an outline.

    Attributes:
        places: of its vertices or corners (k, m) [m].
        triangles: (t, 3) of them, from 0; (0, 3) of an outline.
        called: tells people which vertex one is.
    """

    places: Array
    triangles: Triangles
    called: Callable[[int], str]


@lru_cache(maxsize=16)
def surface_of(body: RhiSolid) -> Surface:
    """Surface of a solid: turned about the origin of its own axes, which then goes to its point.

    Raises:
        SolidError: the mesh that is kept is none.
    """
    own = _from_mesh(body) if body.kept is not None else _written(body)
    places, m = own.places, own.places.shape[1]
    if body.turn is not None:
        places = places @ axes(m, body.turn).T
    if body.point is not None:
        places = places + body.point
    return Surface(places, own.triangles, own.called)


def _written(body: RhiSolid) -> Surface:
    return Surface(np.array(body.vertices), np.array(body.triangles or (), int).reshape(-1, 3), numbered)


def _from_mesh(body: RhiSolid) -> Surface:
    """In its own axes [m]."""
    assert body.kept is not None
    try:
        mesh = read_mesh(".obj", body.kept.obj.encode())
    except UnfitFileError as error:
        raise SolidError(error.problem, error.fix) from error
    scale = body.scale * DIMENSIONS["length"][body.unit or "m"]
    return Surface(scale * mesh.vertices, mesh.triangles, mesh.called)


def turns(m: int) -> int:
    """How many angles turn a body in m directions."""
    return m * (m - 1) // 2


def axes(m: int, turn: Sequence[float]) -> Array:
    """Directions of a box's sides as columns (m, m), turned by an angle, or by roll, pitch and yaw."""
    if m == 3 and turn:
        return np.asarray(pin.rpy.rpyToMatrix(np.array(turn)))
    if m == 2 and turn:
        c, s = np.cos(turn[0]), np.sin(turn[0])
        return np.array([[c, -s], [s, c]])
    return np.eye(m)
