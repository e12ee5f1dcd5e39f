"""The redundant interface's sections of a configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from ...configs.quantities import (
    Angles,
    Angles3,
    AngularAccelerations,
    AngularDamping,
    AngularDampings,
    AngularSpeeds,
    AngularStiffness,
    AngularStiffnesses,
    Damping,
    Force,
    HandAngularDamping,
    HandAngularStiffness,
    HandTorque,
    Inertias,
    Lengths,
    Lengths3,
    LimitMargin,
    NoiseForce,
    NoiseTorque,
    Sizes,
    Stiffness,
    Thickness,
    TimeConstant,
    Torque,
    Torques,
)
from ...configs.strict import Strict
from ...runtime.core.sections import Config, Hand, Name, Place, Simulation, Substeps
from ..rendering.sections import Factors

Ratio = Annotated[
    float,
    Meta(ge=-100.0, le=100.0, description="a joint's angle over a motor's; drives have gears"),
]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="of the reserve V, which is 0 to 1")]
Component = Annotated[float, Meta(ge=-1000.0, le=1000.0, description="of a direction; its length is free")]


Corner = Annotated[int, Meta(ge=0, le=4095, description="a vertex, counted from 0")]
Corners = tuple[Corner, Corner, Corner]


class RhiMotors(Strict, frozen=True):
    """Motors of a redundant interface and how they drive its joints; one entry a motor."""

    transmission: tuple[tuple[Ratio, ...], ...]
    rotor_inertia: Inertias
    friction: AngularDampings
    torque: Torques
    lower: Angles
    upper: Angles
    velocity: AngularSpeeds
    acceleration: AngularAccelerations


class RhiTask(Strict, frozen=True):
    """What the hand holds, which of its directions count, and where the ellipsoids are measured.

    With turns: the lever at which they count, and points of a tool that meet bodies, in the frame's axes.
    """

    frame: Name
    directions: Annotated[
        tuple[Literal["x", "y", "z", "rx", "ry", "rz"], ...], Meta(min_length=1, max_length=6)
    ]
    home: Angles
    spread: Annotated[float, Meta(gt=1.0, le=1000.0, description="mu of (12): an ellipse; a line")]
    follow: TimeConstant | None = None
    lever: Thickness | None = None
    tool: Annotated[tuple[Lengths3, ...], Meta(min_length=1, max_length=16)] | None = None


class RhiNullSpace(Strict, frozen=True):
    """Gains of the secondary torque, and postures that a scan of the self-motion finds."""

    resolution: Literal["projection", "hqp"]
    step: Torque
    damping: AngularDamping
    cap: Torque
    scan: Annotated[
        int, Meta(ge=0, le=20_000, description="give 0 for none, or up to 20000, which takes seconds")
    ]
    stiffness: AngularStiffness
    ratio: Annotated[float, Meta(ge=0.0, le=2.0, description="K_d alone; crawling")]
    margin: LimitMargin
    spacing: Thickness | None = None


class RhiSaturation(Strict, frozen=True):
    """Observer, thresholds and duration of transitions, headroom while the posture moves."""

    steepness: Annotated[float, Meta(ge=0.01, le=100.0, description="S of (14): a parabola; a step")]
    leave: Share
    come_back: Share
    rho: Annotated[float, Meta(ge=0.0, le=10.0, description="of (19): no transition; minutes")]
    held: Annotated[float, Meta(ge=0.01, le=1.0, description="a part of the torques that is worth having")]
    moving: Torque
    release: TimeConstant
    linger: TimeConstant | None = None
    urgency: Annotated[float, Meta(ge=1.0, le=100.0, description="the paper's; a jump")] = 1.0


class RhiLayer(Strict, frozen=True):
    """A layer of a body, from the surface inwards."""

    thickness: Thickness
    stiffness: Stiffness


class RhiSpot(Strict, frozen=True):
    """Somewhere in a body that it is harder, or softer."""

    point: Lengths
    radius: Thickness
    factor: Annotated[float, Meta(ge=0.01, le=100.0, description="of the stiffness: a hole; a bone")]


class RhiTissue(Strict, frozen=True, kw_only=True):
    """What every body is made of."""

    stiffness: Stiffness
    damping: Damping = Damping(0.0)
    layers: Annotated[tuple[RhiLayer, ...], Meta(max_length=16)] | None = None
    spots: Annotated[tuple[RhiSpot, ...], Meta(max_length=16)] | None = None


class RhiPlane(RhiTissue, frozen=True, kw_only=True, tag_field="kind", tag="plane"):
    """Everything behind a plane."""

    point: Lengths
    normal: tuple[Component, ...]


class RhiSphere(RhiTissue, frozen=True, kw_only=True, tag_field="kind", tag="sphere"):
    """A sphere, or a disc."""

    point: Lengths
    radius: Thickness


class RhiBox(RhiTissue, frozen=True, kw_only=True, tag_field="kind", tag="box"):
    """A box, or a rectangle."""

    point: Lengths
    size: Sizes
    turn: Angles | None = None
    edge: Thickness = Thickness(2e-3)


MeshScale = Annotated[float, Meta(ge=1e-3, le=1e3, description="of a mesh: a thousandth; a thousand times")]


class RhiMesh(Strict, frozen=True):
    """What a file of a mesh says, by whoever loads the configuration."""

    obj: str


class RhiSolid(RhiTissue, frozen=True, kw_only=True, tag_field="kind", tag="solid"):
    """What a closed outline or closed triangles enclose: written down here, or in a file beside it."""

    vertices: Annotated[tuple[Lengths, ...], Meta(min_length=3, max_length=4096)] | None = None
    triangles: Annotated[tuple[Corners, ...], Meta(max_length=8192)] | None = None
    mesh: Annotated[str, Meta(min_length=1, max_length=100)] | None = None
    unit: Literal["m", "cm", "mm"] | None = None
    scale: MeshScale = 1.0
    point: Lengths | None = None
    turn: Angles | None = None
    cell: Thickness = Thickness(4e-3)
    kept: RhiMesh | None = None


class RhiAssist(Strict, frozen=True, kw_only=True, tag_field="kind", tag="assist"):
    """A field that helps the hand towards a place."""

    point: Lengths
    force: Force
    soft: Thickness


class RhiResist(Strict, frozen=True, kw_only=True, tag_field="kind", tag="resist"):
    """A field that resists motion."""

    point: Lengths
    radius: Thickness
    damping: Damping


RhiBody = RhiPlane | RhiSphere | RhiBox | RhiSolid | RhiAssist | RhiResist


class RhiHold(Strict, frozen=True):
    """Joint-space controller that holds a posture and brings the machine to rest."""

    stiffness: AngularStiffnesses
    damping: AngularDampings


class Rhi(Strict, frozen=True):
    """Everything the controller of a redundant interface needs."""

    motors: RhiMotors
    task: RhiTask
    null_space: RhiNullSpace
    saturation: RhiSaturation
    bodies: dict[Name, RhiBody]
    hold: RhiHold


class RhiPlant(Strict, frozen=True, kw_only=True):
    """What the simulated interface has beyond its controller's model."""

    posture: Angles
    friction: AngularDampings
    brake_torque: Torques
    force_noise: NoiseForce
    torque_noise: NoiseTorque | None = None
    substeps: Substeps
    masses: Factors = 1.0


class RhiWaypoint(Place, frozen=True):
    """A place of the hand, and how far it is turned from where the handle begins."""

    turned: Angles3 | None = None


class RhiHand(Hand, frozen=True, kw_only=True):
    """The simulated operator's hand; without a torque the handle turns freely in it."""

    rotational_stiffness: HandAngularStiffness | None = None
    rotational_damping: HandAngularDamping | None = None
    torque: HandTorque | None = None
    path: Annotated[tuple[RhiWaypoint, ...], Meta(min_length=2, max_length=5000)]


class RhiSimulation(Simulation, frozen=True, kw_only=True):
    """The simulated redundant interface."""

    rhi: RhiPlant
    hand: RhiHand


class RhiConfig(Config, frozen=True, kw_only=True, tag="rhi"):
    """A redundant haptic interface."""

    rhi: Rhi
    simulation: RhiSimulation | None = None
