"""Sections of an avatar's configuration."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from ...configs.quantities import (
    AngularDamping,
    AngularStiffness,
    Damping,
    Fade,
    Lengths3,
    Stiffness,
)
from ...configs.strict import Strict
from ...runtime.core.sections import Config
from ..telemanipulation.sections import Station, StationSimulation


class Impedance(Strict, frozen=True):
    """Spring and damper from the palm to where it is to be, and the time in which it goes there at first."""

    stiffness: Stiffness
    rotational_stiffness: AngularStiffness
    damping: Damping
    rotational_damping: AngularDamping
    fade: Fade


class Avatar(Station, frozen=True, kw_only=True):
    """What the controller of the avatar needs."""

    impedance: Impedance


class Wall(Strict, frozen=True):
    """A half-space in front of the palms; ``normal`` points out of it."""

    point: Lengths3
    normal: Lengths3
    stiffness: Stiffness
    damping: Damping


class AvatarSimulation(StationSimulation, frozen=True, kw_only=True):
    """The simulated avatar, what it may touch, and the hands that lead it as long as no station does."""

    walls: Annotated[tuple[Wall, ...], Meta(max_length=20)] | None = None


class AvatarConfig(Config, frozen=True, kw_only=True, tag="avatar"):
    """An avatar."""

    avatar: Avatar
    simulation: AvatarSimulation | None = None
