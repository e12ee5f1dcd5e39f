"""The giant's sections of a configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from ...configs.quantities import (
    Acceleration,
    AngleLimits6,
    Angles2,
    Angles3,
    Angles6,
    AngularAccelerations6,
    AngularDampings6,
    AngularSpeeds6,
    AngularStiffnesses6,
    DryTorques6,
    GearDampings6,
    HandAngularDamping,
    HandAngularStiffness,
    HandTorque,
    Inertias3,
    Inertias6,
    Lengths2,
    Lengths3,
    NoiseAcceleration,
    NoiseForce,
    NoiseTorque,
    Rate,
    Speed,
    StopMarginLength,
    TimeConstant,
    Torques6,
)
from ...configs.strict import Strict
from ...runtime.core.sections import Config, Hand, Place, Safety, Simulation, Substeps
from ..rendering.sections import (
    SPRINGS_DIFFER,
    Away,
    Compliance,
    ForceControl,
    Handle,
    LookAhead,
    Plant,
    Push,
    Share,
    StiffnessTolerance,
    Twin,
    Twins,
    named_twins,
)
from ..telemanipulation.sections import Leads

Shares6 = Annotated[tuple[Share, ...], Meta(min_length=6, max_length=6)]
"""Of the torques in the joints' springs."""


class GiantSafety(Safety, frozen=True):
    """The same distance for the axes of the PPU."""

    ppu_margin: StopMarginLength


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


class Tracking(Strict, frozen=True):
    """Series elasticity and friction of the joints, and the gains of their motor-side controllers."""

    rotor_inertia: Inertias6
    stiffness: AngularStiffnesses6
    p_gain: AngularStiffnesses6
    d_gain: AngularDampings6
    stiffness_tolerance: StiffnessTolerance = SPRINGS_DIFFER
    estimation: Literal["measured", "kalman"] = "measured"
    gear_friction: DryTorques6 | None = None
    gear_damping: GearDampings6 | None = None
    load_friction: Shares6 | None = None
    bearing_friction: DryTorques6 | None = None


class Giant(Strict, frozen=True):
    """Everything the giant's controller needs."""

    manipulator: Manipulator
    box: Box
    ppu: Ppu
    force_control: ForceControl
    twin: Twin
    tracking: Tracking
    handle: Handle | None = None
    twins: Twins = field(default_factory=dict)


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


class GiantHand(Hand, frozen=True, kw_only=True):
    """The simulated operator's hand, which also holds the handle's direction."""

    rotational_stiffness: HandAngularStiffness
    rotational_damping: HandAngularDamping
    torque: HandTorque
    away: Annotated[tuple[Away, ...], Meta(max_length=1000)] | None = None
    path: Annotated[tuple[Waypoint, ...], Meta(min_length=2, max_length=5000)]


class GiantSimulation(Simulation, frozen=True, kw_only=True):
    """The simulated giant."""

    giant: GiantPlant
    hand: GiantHand
    plant: Plant = field(default_factory=Plant)
    pushes: Annotated[tuple[Push, ...], Meta(max_length=1000)] | None = None


class GiantConfig(Config, frozen=True, kw_only=True, tag="giant"):
    """HapticGiant."""

    safety: GiantSafety
    giant: Giant
    look_ahead: LookAhead | None = None
    compliance: Compliance | None = None
    leads: Leads | None = None
    simulation: GiantSimulation | None = None

    @property
    def twins(self) -> dict[str, Twin]:
        """All that a session may render, the one that it begins with first."""
        return named_twins(self.giant.twin, self.giant.twins)

    @property
    def twin_names(self) -> tuple[str, ...]:
        """Of ``twins``."""
        return tuple(self.twins)
