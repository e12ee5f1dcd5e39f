"""Sections of an avatar's configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from ...configs.quantities import (
    Acceleration,
    AngularAcceleration,
    AngularDampingGain,
    AngularSpeed,
    AngularStiffness,
    Damping,
    DampingGain,
    EitherAngle,
    Fade,
    Instant,
    Lengths3,
    Reach3,
    Speed,
    Stiffness,
    Turn3,
)
from ...configs.strict import Strict
from ...runtime.core.sections import Config
from ..telemanipulation.sections import Share, Station, StationSimulation

Weight = Annotated[float, Meta(ge=-10.0, le=10.0, description="of a joint in a sum")]


class Impedance(Strict, frozen=True):
    """Spring and damper from the palm to where it is to be, and the time in which it goes there at first."""

    stiffness: Stiffness
    rotational_stiffness: AngularStiffness
    damping: DampingGain
    rotational_damping: AngularDampingGain
    fade: Fade


class Followed(Strict, frozen=True, kw_only=True):
    """A drive of a hand: a sum of the glove's joints by their weights, and ``offset``, within a range."""

    follows: dict[str, Weight]
    offset: EitherAngle = EitherAngle(0.0)
    lower: EitherAngle
    upper: EitherAngle


class RobotHand(Strict, frozen=True):
    """A hand of the avatar: the largest speed of its targets, and all its drives by their names."""

    speed: AngularSpeed
    drives: dict[str, Followed]


class RobotHands(Strict, frozen=True):
    """Both hands of the avatar."""

    left: RobotHand
    right: RobotHand


class Neck(Strict, frozen=True):
    """How far the head goes from its middle along and about each axis, how fast, and how suddenly."""

    reach: Reach3
    turn: Turn3
    speed: Speed
    rate: AngularSpeed
    acceleration: Acceleration
    turning: AngularAcceleration


class Base(Strict, frozen=True):
    """How fast the base goes along the floor and turns, how suddenly, and what of a paddle means nothing."""

    speed: Speed
    rate: AngularSpeed
    acceleration: Acceleration
    turning: AngularAcceleration
    dead_zone: Annotated[float, Meta(ge=0.02, le=0.5, description="of a paddle's way; a foot rests on it")]


class Body(Strict, frozen=True):
    """The arm that carries the avatar's head, and its holonomic base."""

    neck: Neck
    base: Base


class Avatar(Station, frozen=True, kw_only=True):
    """What the controller of the avatar needs; without ``hands`` or ``body`` it has none."""

    impedance: Impedance
    hands: RobotHands | None = None
    body: Body | None = None


class Wall(Strict, frozen=True):
    """A half-space in front of the palms; ``normal`` points out of it."""

    point: Lengths3
    normal: Lengths3
    stiffness: Stiffness
    damping: Damping


class Thing(Strict, frozen=True):
    """What lies in a hand for a time: its drives meet it at a share of their range, and no tighter."""

    side: Literal["left", "right"]
    at: Instant
    until: Instant
    share: Share
    stiffness: AngularStiffness


class AvatarSimulation(StationSimulation, frozen=True, kw_only=True):
    """The simulated avatar, what it may touch, and the hands that lead it as long as no station does."""

    walls: Annotated[tuple[Wall, ...], Meta(max_length=20)] | None = None
    things: Annotated[tuple[Thing, ...], Meta(max_length=100)] | None = None


class AvatarConfig(Config, frozen=True, kw_only=True, tag="avatar"):
    """An avatar."""

    avatar: Avatar
    simulation: AvatarSimulation | None = None
