"""Sections of a configuration that both stations have."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from ...configs.quantities import (
    Angles,
    Angles3,
    AngularAccelerations,
    AngularDampingGain,
    AngularDampings,
    AngularSpeeds,
    AngularStiffness,
    AngularStiffnesses,
    Delay,
    Force,
    Frequency,
    HandAngularDamping,
    HandAngularStiffness,
    HandTorque,
    Inertias,
    Inertias3,
    Instant,
    Lengths3,
    NoiseForce,
    NoiseTorque,
    Torque,
    Torques,
)
from ...configs.strict import Strict
from ...runtime.core.sections import Hand, Name, Place, Simulation, Substeps
from ..rendering.sections import Arm, Handle, Plant

Push = Annotated[float, Meta(ge=-1.0, le=1.0, description="of the way of an axis")]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="of what there is")]
Gain = Annotated[float, Meta(ge=0.0, le=4.0, description="more than that no arm follows")]


class Chain(Arm, frozen=True):
    """An arm of the model and its joints; a list has an entry for each joint."""

    lower: Angles
    upper: Angles
    velocity: AngularSpeeds
    home: Angles


class OwnChain(Chain, frozen=True):
    """An arm of this station, and what hangs on its sensor, unless the sensor's calibration says that.

    Both in the axes of the sensor, which are the flange's; what hangs there also weighs on the arm.
    """

    tool: Handle | None = None


class Posture(Strict, frozen=True):
    """What draws the elbow home, where the palm leaves it free."""

    stiffness: AngularStiffness
    damping: AngularDampingGain


class Hold(Strict, frozen=True):
    """Joints are held, and brought to rest in a stop, by springs and dampers; a number for each joint."""

    stiffness: AngularStiffnesses
    damping: AngularDampings
    deceleration: AngularAccelerations


class OwnStop(Strict, frozen=True):
    """An arm whose palm feels more than this, or a joint of which is faster than it may be, stops itself."""

    force: Force
    torque: Torque


class Link(Strict, frozen=True):
    """To the other station: the longest delay that is no fault, and where a simulated station's link is.

    ``passivity`` bounds the energy that the link may give out. With an address the simulated plant opens the
    link itself: the avatar's waits there, the operator's calls.
    """

    delay: Delay = Delay(0.0)
    passivity: bool = True
    address: Name | None = None
    port: Annotated[int, Meta(ge=1, le=65535, description="a port of TCP, and of UDP")] = 4840
    keys: Name | None = None
    avatar: Name = "avatar"


class Sides(Strict, frozen=True):
    """Both arms of a station."""

    left: OwnChain
    right: OwnChain


class Station(Strict, frozen=True, kw_only=True):
    """What the controller of either station needs."""

    arms: Sides
    posture: Posture
    hold: Hold
    stop: OwnStop
    link: Link = field(default_factory=Link)


class FarArms(Strict, frozen=True):
    """Both arms of the avatar, as another station believes them to be, and what draws their elbows home."""

    left: Chain
    right: Chain
    posture: Posture


class Leads(FarArms, frozen=True, kw_only=True):
    """What a machine needs whose twin is an arm of an avatar, and leads it.

    ``side`` says which; the other one is led by nobody. ``feedback`` is the gain of what its palm feels, of
    which no more than ``most`` is given back.
    """

    side: Literal["left", "right"]
    most: OwnStop
    feedback: Gain = 1.0
    link: Link = field(default_factory=Link)


class SimArms(Strict, frozen=True):
    """The simulated arms and their force-torque sensors; a number for each joint where there are several.

    ``tool_mass`` is a factor to what the controllers believe. The sensors smooth by themselves with
    ``cutoff`` and sample every ``periods`` of the bus.
    """

    rotor_inertia: Inertias
    brake: Torques
    tool_inertia: Inertias3
    force_noise: NoiseForce
    torque_noise: NoiseTorque
    cutoff: Frequency
    periods: Annotated[int, Meta(ge=1, le=20, description="slower, and it would seem frozen")]
    substeps: Substeps
    tool_mass: Annotated[float, Meta(ge=0.1, le=10.0, description="times what the controller believes")] = 1.0


class Poses(Place, frozen=True):
    """Where both palms are to be: the right one at ``position``; rotation vectors from the station's axes."""

    turned: Angles3
    left: Lengths3
    left_turned: Angles3


class Hands(Hand, frozen=True, kw_only=True):
    """The hands of the simulated person."""

    rotational_stiffness: HandAngularStiffness
    rotational_damping: HandAngularDamping
    torque: HandTorque
    path: Annotated[tuple[Poses, ...], Meta(min_length=2, max_length=5000)]


class Pushed(Strict, frozen=True):
    """A button is pressed for a time."""

    at: Instant
    until: Instant
    left: bool = False
    right: bool = False


class Closed(Strict, frozen=True):
    """How far the person wants the fingers of either hand to be closed at a time, 0 to 1."""

    at: Instant
    left: Share
    right: Share


class Headed(Strict, frozen=True):
    """Where the person's head is at a time, in the tracker's axes; turned by a rotation vector."""

    at: Instant
    position: Lengths3
    turned: Angles3


class Trodden(Strict, frozen=True):
    """How far the paddle is pushed at a time: forward, to the left, about the upright axis, -1 to 1."""

    at: Instant
    axes: tuple[Push, Push, Push]


class StationSimulation(Simulation, frozen=True, kw_only=True):
    """The simulated station."""

    arms: SimArms
    hand: Hands
    fingers: Annotated[tuple[Closed, ...], Meta(min_length=2, max_length=5000)] | None = None
    head: Annotated[tuple[Headed, ...], Meta(min_length=2, max_length=5000)] | None = None
    paddle: Annotated[tuple[Trodden, ...], Meta(min_length=2, max_length=5000)] | None = None
    plant: Plant = field(default_factory=Plant)
