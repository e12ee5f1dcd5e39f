"""Sections of a configuration that every machine has that renders a twin with a serial arm."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from ...configs.quantities import (
    Acceleration,
    AngleRange,
    Angles3,
    AngularAcceleration,
    AngularDamping,
    AngularSpeed,
    AngularStiffness,
    AnyAngle,
    AnyForce,
    AnyLength,
    AnyTorque,
    Clearance,
    Damping,
    Duration,
    Force,
    Forces3,
    Gravity,
    HandleMass,
    Horizon,
    Inertia,
    Inertias3,
    Instant,
    LeadTime,
    LeastInertia,
    LeastMass,
    Length,
    LengthRange,
    Lengths3,
    Mass,
    Rate,
    RateSquared,
    RelaxTime,
    Sizes3,
    SomeAngle,
    Speed,
    Stiffness,
    Torque,
    TwinInertia,
    TwinMass,
)
from ...configs.strict import Strict
from ...runtime.core.sections import Name

Factor = Annotated[float, Meta(ge=0.1, le=10.0, description="times what the controller believes")]
ComplianceShare = Annotated[
    float,
    Meta(ge=0.02, le=0.4, description="of a motor's torque; beyond half of it a joint that is led stops"),
]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="of the torque of a joint")]
StiffnessTolerance = Annotated[
    float, Meta(ge=0.0, le=0.6, description="a share; who knows less of a spring must measure it first")
]
SPRINGS_DIFFER = 0.4
"""Share by which springs may be stiffer or softer than a controller believes, unless it is told another."""
Factors = Factor | Annotated[tuple[Factor, ...], Meta(min_length=1, max_length=16)]
Shares = Share | Annotated[tuple[Share, ...], Meta(min_length=1, max_length=16)]
Ticks = Annotated[int, Meta(ge=0, le=20, description="longer, and every watchdog would have acted")]


class ForceControl(Strict, frozen=True):
    """Detection rule and gains of the hierarchical force control."""

    detection: Literal["previous", "redetect", "gauss"]
    p_gain: RateSquared
    d_gain: Rate
    viability_horizon: Horizon
    point_horizon: Horizon
    passivity: bool = False
    lead: LeadTime | None = None


TwinName = Annotated[
    str, Meta(pattern="^[a-z0-9_]{1,24}$", description="give 1 to 24 of a to z, 0 to 9 and _")
]
"""Of a twin among several: it is typed, and stands on buttons."""


class CartesianTwin(Strict, frozen=True, tag_field="kind", tag="cartesian"):
    """A free mass as the digital twin."""

    mass: TwinMass
    inertia: TwinInertia
    damping: Damping
    rotational_damping: AngularDamping
    velocity: Speed
    rotational_velocity: AngularSpeed
    acceleration: Acceleration
    rotational_acceleration: AngularAcceleration
    name: TwinName | None = None


class Row(Strict, frozen=True):
    """A row of a Denavit-Hartenberg table: Rz(theta) Tz(d) Tx(a) Rx(alpha)."""

    theta: AnyAngle = AnyAngle(0.0)
    d: AnyLength = AnyLength(0.0)
    a: AnyLength = AnyLength(0.0)
    alpha: AnyAngle = AnyAngle(0.0)


class Body(Strict, frozen=True):
    """What the link behind a row weighs; centre and principal moments in the frame behind the row."""

    mass: Mass
    centre: Lengths3
    moments: Inertias3


class RevoluteLock(Strict, frozen=True):
    """What locks a turning joint: another joint is the key."""

    key: Name
    unlock: AnyAngle
    relock: SomeAngle


class PrismaticLock(Strict, frozen=True):
    """The same of a sliding joint."""

    key: Name
    unlock: AnyAngle
    relock: Length


class RevoluteDetent(Strict, frozen=True):
    """A place where a turning joint likes to stay."""

    at: AnyAngle
    torque: Torque
    width: SomeAngle


class PrismaticDetent(Strict, frozen=True):
    """The same of a sliding joint."""

    at: AnyLength
    torque: Force
    width: Length


class RevoluteTwinJoint(Strict, frozen=True, tag_field="type", tag="revolute"):
    """A joint of the twin that turns."""

    start: AnyAngle
    range: AngleRange | None = None
    velocity: AngularSpeed | None = None
    acceleration: AngularAcceleration | None = None
    inertia: Inertia | None = None
    damping: AngularDamping | None = None
    drive: AnyTorque = AnyTorque(0.0)
    stiffness: AngularStiffness | None = None
    rest: AnyAngle = AnyAngle(0.0)
    dh: Row | None = None
    body: Body | None = None
    lock: RevoluteLock | None = None
    detents: Annotated[tuple[RevoluteDetent, ...], Meta(max_length=64)] | None = None


class PrismaticTwinJoint(Strict, frozen=True, tag_field="type", tag="prismatic"):
    """A joint of the twin that slides; its inertia is a mass here."""

    start: AnyLength
    range: LengthRange | None = None
    velocity: Speed | None = None
    acceleration: Acceleration | None = None
    inertia: Mass | None = None
    damping: Damping | None = None
    drive: AnyForce = AnyForce(0.0)
    stiffness: Stiffness | None = None
    rest: AnyLength = AnyLength(0.0)
    dh: Row | None = None
    body: Body | None = None
    lock: PrismaticLock | None = None
    detents: Annotated[tuple[PrismaticDetent, ...], Meta(max_length=64)] | None = None


TwinJoint: TypeAlias = RevoluteTwinJoint | PrismaticTwinJoint


class Arm(Strict, frozen=True):
    """One arm of a model: all joints whose names begin with ``prefix``, and its palm seen from its flange.

    ``turned`` is a rotation vector from the flange's axes.
    """

    prefix: Name
    palm: Lengths3
    turned: Angles3


class KeptModel(Strict, frozen=True):
    """The model of a twin, as a recording keeps it."""

    urdf: Annotated[str, Meta(max_length=200_000)]


class ChainTwin(Strict, frozen=True, tag_field="kind", tag="chain"):
    """A serial chain as the digital twin: a URDF, or a Denavit-Hartenberg row for each joint.

    ``urdf`` names a file beside the configuration; whoever loads it keeps the text of the file in ``kept``.
    Of a model with several arms ``arm`` is the one, whose end is its palm.
    What its end weighs in its lightest direction is made up to ``least_mass`` and ``least_inertia``.
    """

    joints: dict[Name, TwinJoint]
    urdf: Name | None = None
    kept: KeptModel | None = None
    end: Name | None = None
    arm: Arm | None = None
    base: Angles3 | None = None
    gravity: Gravity = Gravity(0.0)
    least_mass: LeastMass = LeastMass(1.5)
    least_inertia: LeastInertia = LeastInertia(0.03)
    name: TwinName | None = None


Twin: TypeAlias = CartesianTwin | ChainTwin
Twins: TypeAlias = dict[TwinName, Twin]
"""Twins that the one of the start may be exchanged for, by their names."""


def named_twins(first: Twin, others: Twins) -> dict[str, Twin]:
    """All of them by their names, the one of the start first; one that has no name is what it is."""
    kind = "mass" if isinstance(first, CartesianTwin) else "chain"
    found: dict[str, Twin] = {first.name or kind: first}
    for name, twin in others.items():
        found.setdefault(name, twin)
    return found


class Obstacle(Strict, frozen=True):
    """A box that stands beside the machine, in the axes of the base; turned by roll, pitch and yaw."""

    name: Name
    centre: Lengths3
    size: Sizes3
    angles: Angles3 | None = None


class LookAhead(Strict, frozen=True):
    """How near the machine may come to itself and to what is around it; ``floor`` is a height.

    What of itself is watched are the collision shapes of its model.
    """

    margin: Clearance
    floor: AnyLength | None = None
    obstacles: Annotated[tuple[Obstacle, ...], Meta(max_length=40)] | None = None


class Compliance(Strict, frozen=True):
    """Pushes on the links that give way: a share of each motor's torque, and how fast they are relieved."""

    threshold: ComplianceShare
    relax: RelaxTime


class Push(Strict, frozen=True):
    """Something pushes a frame of the simulated machine for a time, with a force in the axes of the base."""

    at: Instant
    seconds: Duration
    frame: Name
    force: Forces3


class Away(Strict, frozen=True):
    """The hand lets go of the handle for a time."""

    at: Instant
    seconds: Duration


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
