"""The environment that a configuration describes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from .config import Rhi, RhiAssist, RhiBody, RhiBox, RhiPlane, RhiResist, RhiSolid, RhiSphere, RhiTissue
from .environment import Body, Environment, Rendered
from .fields import Assist, Resist
from .placed import axes, surface_of
from .redundant import PLACE, RedundantArm
from .shapes import Box, Plane, Sampled, Shape, Sphere
from .solid import solid
from .tissue import Spot, Tissue
from .tool import Tool


def environment(bodies: Mapping[str, RhiBody]) -> Environment:
    """Everything that is rendered.

    Raises:
        SolidError: a surface encloses nothing, or would need too many nodes.
    """
    return Environment([_rendered(body) for body in bodies.values()])


def surroundings(rhi: Rhi, arm: RedundantArm) -> Environment | Tool:
    """What the hand meets: bodies, and with turns by the points of its tool, or else by its own place.

    Raises:
        SolidError: see ``environment``.
    """
    rendered = environment(rhi.bodies)
    return Tool(rendered, rhi.task.tool or [(0.0, 0.0, 0.0)], arm) if arm.m > PLACE else rendered


def _rendered(body: RhiBody) -> Rendered:
    if isinstance(body, RhiAssist):
        return Assist(body.point, body.force, body.soft)
    if isinstance(body, RhiResist):
        return Resist(body.point, body.radius, body.damping)
    return Body(shape(body), _tissue(body))


def shape(body: RhiPlane | RhiSphere | RhiBox | RhiSolid) -> Shape:
    """Where a body is.

    Raises:
        SolidError: see ``environment``.
    """
    if isinstance(body, RhiPlane):
        return Plane(body.point, body.normal)
    if isinstance(body, RhiSphere):
        return Sphere(body.point, body.radius)
    if isinstance(body, RhiBox):
        return Box(body.point, body.size, axes(len(body.size), body.turn or ()), body.edge)
    return _solid(body)


@lru_cache(maxsize=16)
def _solid(body: RhiSolid) -> Sampled:
    """Its depths, which take a second or more to sample and are asked for by each check."""
    surface = surface_of(body)
    return solid(surface.places, surface.triangles, body.cell, surface.called)


def _tissue(body: RhiTissue) -> Tissue:
    layers = [(layer.thickness, layer.stiffness) for layer in body.layers or ()]
    spots = [Spot(spot.point, spot.radius, spot.factor) for spot in body.spots or ()]
    return Tissue(body.stiffness, body.damping, layers, spots)
