"""The giant's sections of a configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from ..quantities import (
    Acceleration,
    AngleLimits6,
    Angles2,
    Angles3,
    Angles6,
    AngularAcceleration,
    AngularAccelerations6,
    AngularDamping,
    AngularDampings6,
    AngularSpeed,
    AngularSpeeds6,
    AngularStiffnesses6,
    Damping,
    HandAngularDamping,
    HandAngularStiffness,
    HandleMass,
    HandTorque,
    Inertias3,
    Inertias6,
    Length,
    Lengths2,
    Lengths3,
    NoiseAcceleration,
    NoiseForce,
    NoiseTorque,
    Rate,
    RateSquared,
    Speed,
    TimeConstant,
    Torques6,
    TwinInertia,
    TwinMass,
)
from ..sections import Config, Hand, Place, Safety, Simulation, Strict, Substeps


class GiantSafety(Safety, frozen=True):
    """The same distance for the axes of the PPU."""

    ppu_margin: Length


class Manipulator(Strict, frozen=True):
    """Limits of joints 1 to 6 and of their virtual sum joint q4 + q5."""

    lower: AngleLimits6
    upper: AngleLimits6
    velocity: AngularSpeeds6
    acceleration: AngularAccelerations6
    tilt: Angles2


class Box(Strict, frozen=True):
    """Cartesian range of handle and elbow."""

    lower: Lengths3
    upper: Lengths3


class Ppu(Strict, frozen=True):
    """Prepositioning unit: limits, P-gain and the time constant of its velocity loop."""

    lower: Lengths2
    upper: Lengths2
    velocity: Speed
    acceleration: Acceleration
    gain: Rate
    time_constant: TimeConstant


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


class Tracking(Strict, frozen=True):
    """Series elasticity of the joints and the gains of their motor-side controllers."""

    rotor_inertia: Inertias6
    stiffness: AngularStiffnesses6
    p_gain: AngularStiffnesses6
    d_gain: AngularDampings6


class Handle(Strict, frozen=True):
    """What hangs on the force-torque sensor."""

    mass: HandleMass
    centre: Lengths3


class Giant(Strict, frozen=True):
    """Everything the giant's controller needs."""

    manipulator: Manipulator
    box: Box
    ppu: Ppu
    force_control: ForceControl
    twin: CartesianTwin
    tracking: Tracking
    handle: Handle


class GiantPlant(Strict, frozen=True):
    """What the simulated giant has beyond its controller's model."""

    posture: Angles6
    ppu: Lengths2
    spring_damping: AngularDampings6
    brake_torque: Torques6
    handle_inertia: Inertias3
    force_noise: NoiseForce
    torque_noise: NoiseTorque
    acceleration_noise: NoiseAcceleration
    substeps: Substeps


class Waypoint(Place, frozen=True):
    """A pose of the hand: besides its position, yaw and tilt of the handle's axis, and roll about it."""

    angles: Angles3


class GiantHand(Hand, frozen=True):
    """The simulated operator's hand, which also holds the handle's direction."""

    rotational_stiffness: HandAngularStiffness
    rotational_damping: HandAngularDamping
    torque: HandTorque
    path: Annotated[tuple[Waypoint, ...], Meta(min_length=2, max_length=5000)]


class GiantSimulation(Simulation, frozen=True, kw_only=True):
    """The simulated giant."""

    giant: GiantPlant
    hand: GiantHand


class GiantConfig(Config, frozen=True, kw_only=True, tag="giant"):
    """HapticGiant."""

    safety: GiantSafety
    giant: Giant
    simulation: GiantSimulation | None = None
