"""An arm's sections of a configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from ...configs.quantities import (
    Acceleration,
    AngleRange,
    Angles3,
    AngularAcceleration,
    AngularDamping,
    AngularDampingGain,
    AngularSpeed,
    AngularStiffness,
    AnyAngle,
    AnyLength,
    Corner,
    Damping,
    DampingGain,
    DryForce,
    DryTorque,
    Force,
    HandAngularDamping,
    HandAngularStiffness,
    HandTorque,
    Inertia,
    Inertias3,
    LengthRange,
    Mass,
    NoiseForce,
    NoiseTorque,
    Rate,
    RateSquared,
    Speed,
    Stiffness,
    StopMarginLength,
    Torque,
)
from ...configs.strict import Strict
from ...runtime.core.sections import Config, Hand, Name, Place, Safety, Simulation, Substeps
from ..rendering.sections import (
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

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
"""Along and about the axes of the base."""
Direction = Literal["x", "y", "z", "rx", "ry", "rz"]
Weight = Annotated[float, Meta(ge=-100.0, le=100.0, description="of a joint in a sum; gears have ratios")]


class ArmSafety(Safety, frozen=True):
    """The same distance for sliding joints."""

    slide_margin: StopMarginLength | None = None


class RevoluteJoint(Strict, frozen=True, tag_field="type", tag="revolute"):
    """Limits, drive and controller of a joint that turns; without a stiffness nothing in it yields."""

    range: AngleRange
    velocity: AngularSpeed
    acceleration: AngularAcceleration
    rotor_inertia: Inertia
    p_gain: AngularStiffness
    d_gain: AngularDampingGain
    stiffness: AngularStiffness | None = None
    home: AnyAngle | None = None
    gear_friction: DryTorque | None = None
    gear_damping: AngularDamping | None = None
    load_friction: Share | None = None
    bearing_friction: DryTorque | None = None


class PrismaticJoint(Strict, frozen=True, tag_field="type", tag="prismatic"):
    """The same of a joint that slides; its rotor's inertia is a mass here."""

    range: LengthRange
    velocity: Speed
    acceleration: Acceleration
    rotor_inertia: Mass
    p_gain: Stiffness
    d_gain: DampingGain
    stiffness: Stiffness | None = None
    home: AnyLength | None = None
    gear_friction: DryForce | None = None
    gear_damping: Damping | None = None
    load_friction: Share | None = None
    bearing_friction: DryForce | None = None


class RevoluteSum(Strict, frozen=True, tag_field="type", tag="revolute"):
    """A weighted sum of turning joints with limits of its own."""

    name: Name
    weights: dict[str, Weight]
    range: AngleRange


class PrismaticSum(Strict, frozen=True, tag_field="type", tag="prismatic"):
    """A weighted sum of sliding joints with limits of its own."""

    name: Name
    weights: dict[str, Weight]
    range: LengthRange


class ArmBox(Strict, frozen=True):
    """A frame of the model and the Cartesian range of its origin."""

    frame: Name
    lower: Corner
    upper: Corner


class Frames(Strict, frozen=True):
    """Frames of the model that the hand and the sensor are at."""

    handle: Name
    sensor: Name


class Posture(Strict, frozen=True):
    """How the joints are drawn home where the handle leaves them free."""

    stiffness: RateSquared
    damping: Rate


class Arm(Strict, frozen=True):
    """Everything the controller of an arm needs."""

    directions: Annotated[tuple[Direction, ...], Meta(min_length=1, max_length=6)]
    frames: Frames
    joints: dict[str, RevoluteJoint | PrismaticJoint]
    force_control: ForceControl
    twin: Twin
    handle: Handle | None = None
    stiffness_tolerance: StiffnessTolerance | None = None
    twins: Twins = field(default_factory=dict)
    posture: Posture | None = None
    sums: tuple[RevoluteSum | PrismaticSum, ...] | None = None
    boxes: tuple[ArmBox, ...] | None = None


class RevolutePlant(Strict, frozen=True, tag_field="type", tag="revolute"):
    """Where a turning joint begins, its brake, and what differs from what the controller believes."""

    start: AnyAngle
    brake: Torque
    spring_damping: AngularDamping | None = None
    rotor_inertia: Inertia | None = None
    stiffness: AngularStiffness | None = None
    friction: AngularDamping | None = None


class PrismaticPlant(Strict, frozen=True, tag_field="type", tag="prismatic"):
    """The same of a sliding joint."""

    start: AnyLength
    brake: Force
    spring_damping: Damping | None = None
    rotor_inertia: Mass | None = None
    stiffness: Stiffness | None = None
    friction: Damping | None = None


class ArmPlantSection(Strict, frozen=True):
    """What the simulated arm has beyond its controller's model."""

    joints: dict[str, RevolutePlant | PrismaticPlant]
    handle_inertia: Inertias3
    force_noise: NoiseForce
    torque_noise: NoiseTorque
    substeps: Substeps


class Waypoint(Place, frozen=True):
    """A pose of the hand: its position, and how far it is turned from where the handle begins."""

    turned: Angles3


class ArmHand(Hand, frozen=True, kw_only=True):
    """The simulated operator's hand; without a torque the handle turns freely in it."""

    rotational_stiffness: HandAngularStiffness | None = None
    rotational_damping: HandAngularDamping | None = None
    torque: HandTorque | None = None
    away: Annotated[tuple[Away, ...], Meta(max_length=1000)] | None = None
    path: Annotated[tuple[Waypoint, ...], Meta(min_length=2, max_length=5000)]


class ArmSimulation(Simulation, frozen=True, kw_only=True):
    """The simulated arm."""

    arm: ArmPlantSection
    hand: ArmHand
    plant: Plant = field(default_factory=Plant)
    pushes: Annotated[tuple[Push, ...], Meta(max_length=1000)] | None = None


class ArmConfig(Config, frozen=True, kw_only=True, tag="arm"):
    """A serial arm."""

    safety: ArmSafety
    arm: Arm
    look_ahead: LookAhead | None = None
    compliance: Compliance | None = None
    simulation: ArmSimulation | None = None

    @property
    def twins(self) -> dict[str, Twin]:
        """All that a session may render, the one that it begins with first."""
        return named_twins(self.arm.twin, self.arm.twins)

    @property
    def twin_names(self) -> tuple[str, ...]:
        """Of ``twins``."""
        return tuple(self.twins)
