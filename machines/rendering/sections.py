"""Sections of a configuration that every machine has that renders a twin with a serial arm."""

from __future__ import annotations

from typing import Literal

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
