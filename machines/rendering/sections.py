"""Sections of a configuration that every machine has that renders a twin with a serial arm."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from ...configs.quantities import (
    Acceleration,
    AngularAcceleration,
    AngularDamping,
    AngularSpeed,
    Damping,
    HandleMass,
    Lengths3,
    Rate,
    RateSquared,
    Speed,
    TimeConstant,
    TwinInertia,
    TwinMass,
)
from ...configs.strict import Strict

Factor = Annotated[float, Meta(ge=0.1, le=10.0, description="times what the controller believes")]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="of the torque of a joint")]
Factors = Factor | Annotated[tuple[Factor, ...], Meta(min_length=1, max_length=16)]
Shares = Share | Annotated[tuple[Share, ...], Meta(min_length=1, max_length=16)]
Ticks = Annotated[int, Meta(ge=0, le=20, description="longer, and every watchdog would have acted")]


class ForceControl(Strict, frozen=True):
    """Detection rule and gains of the hierarchical force control."""

    detection: Literal["previous", "redetect", "gauss"]
    p_gain: RateSquared
    d_gain: Rate
    viability_horizon: TimeConstant
    point_horizon: TimeConstant


class CartesianTwin(Strict, frozen=True):
    """A free mass as the digital twin."""

    kind: Literal["cartesian"]
    mass: TwinMass
    inertia: TwinInertia
    damping: Damping
    rotational_damping: AngularDamping
    velocity: Speed
    rotational_velocity: AngularSpeed
    acceleration: Acceleration
    rotational_acceleration: AngularAcceleration


class Handle(Strict, frozen=True):
    """What hangs on the force-torque sensor."""

    mass: HandleMass
    centre: Lengths3


class Plant(Strict, frozen=True):
    """Where the simulated machine is not what its controller believes: a number for all joints, or one each.

    ``masses``, ``rotor_inertia``, ``stiffness`` and ``viscous_friction`` are factors; dry friction of gears
    and bearings is a share of the joint's effort, ``load_friction`` of the torque that a gear carries; the
    drives obey ``delay`` ticks late.
    """

    masses: Factors = 1.0
    rotor_inertia: Factors = 1.0
    stiffness: Factors = 1.0
    viscous_friction: Factors = 1.0
    gear_friction: Shares = 0.0
    load_friction: Shares = 0.0
    bearing_friction: Shares = 0.0
    delay: Ticks = 0
