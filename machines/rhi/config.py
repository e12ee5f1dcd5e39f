"""The redundant interface's sections of a configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from ...configs.quantities import (
    Angles,
    AngularAccelerations,
    AngularDamping,
    AngularDampings,
    AngularSpeeds,
    AngularStiffness,
    AngularStiffnesses,
    Inertias,
    Lengths,
    LimitMargin,
    NoiseForce,
    Stiffness,
    TimeConstant,
    Torque,
    Torques,
)
from ...configs.strict import Strict
from ...runtime.core.sections import Config, Name, Simulation, Substeps

Ratio = Annotated[
    float,
    Meta(ge=-100.0, le=100.0, description="a joint's angle over a motor's; drives have gears"),
]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="of the reserve V, which is 0 to 1")]
Component = Annotated[float, Meta(ge=-1000.0, le=1000.0, description="of a direction; its length is free")]


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
    """What the hand holds, which of its directions count, and where the ellipsoids are measured."""

    frame: Name
    directions: Annotated[tuple[Literal["x", "y", "z"], ...], Meta(min_length=1, max_length=3)]
    home: Angles
    spread: Annotated[float, Meta(gt=1.0, le=1000.0, description="mu of (12): an ellipse; a line")]
    follow: TimeConstant | None = None


class RhiNullSpace(Strict, frozen=True):
    """Gains of the secondary torque, and postures that a scan of the self-motion finds."""

    resolution: Literal["projection", "hqp"]
    step: Torque
    damping: AngularDamping
    cap: Torque
    scan: Annotated[int, Meta(ge=0, le=20_000, description="more takes seconds")]
    stiffness: AngularStiffness
    ratio: Annotated[float, Meta(ge=0.0, le=2.0, description="K_d alone; crawling")]
    margin: LimitMargin


class RhiSaturation(Strict, frozen=True):
    """Observer, thresholds and duration of transitions, headroom while the posture moves."""

    steepness: Annotated[float, Meta(ge=0.01, le=100.0, description="S of (14): a parabola; a step")]
    leave: Share
    come_back: Share
    rho: Annotated[float, Meta(ge=0.0, le=10.0, description="of (19): no transition; minutes")]
    held: Annotated[float, Meta(ge=0.01, le=1.0, description="a part of the torques that is worth having")]
    moving: Torque
    release: TimeConstant


class RhiWall(Strict, frozen=True):
    """A spring behind a plane."""

    point: Lengths
    normal: tuple[Component, ...]
    stiffness: Stiffness


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
    wall: RhiWall
    hold: RhiHold


class RhiPlant(Strict, frozen=True):
    """What the simulated interface has beyond its controller's model."""

    posture: Angles
    friction: AngularDampings
    brake_torque: Torques
    force_noise: NoiseForce
    substeps: Substeps


class RhiSimulation(Simulation, frozen=True, kw_only=True):
    """The simulated redundant interface."""

    rhi: RhiPlant


class RhiConfig(Config, frozen=True, kw_only=True, tag="rhi"):
    """A redundant haptic interface."""

    rhi: Rhi
    simulation: RhiSimulation | None = None
