"""The redundant interface's sections of a configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from ..quantities import (
    Angles,
    AngularAccelerations,
    AngularDamping,
    AngularDampings,
    AngularSpeeds,
    AngularStiffness,
    AngularStiffnesses,
    Duration,
    Inertias,
    Lengths,
    NoiseForce,
    Stiffness,
    Torque,
    Torques,
)
from ..sections import Config, Simulation, Strict, Substeps


class RhiMotors(Strict, frozen=True):
    """Motors of a redundant interface and how they drive its joints; one entry a motor."""

    transmission: tuple[tuple[float, ...], ...]
    rotor_inertia: Inertias
    friction: AngularDampings
    torque: Torques
    lower: Angles
    upper: Angles
    velocity: AngularSpeeds
    acceleration: AngularAccelerations


class RhiTask(Strict, frozen=True):
    """What the hand holds, which of its directions count, and where the ellipsoids are measured."""

    frame: str
    directions: tuple[Literal["x", "y", "z"], ...]
    home: Angles
    spread: Annotated[float, Meta(gt=1.0)]
    follow: Duration | None = None


class RhiNullSpace(Strict, frozen=True):
    """Gains of the secondary torque, and postures that a scan of the self-motion finds."""

    resolution: Literal["projection", "hqp"]
    step: Torque
    damping: AngularDamping
    cap: Torque
    scan: Annotated[int, Meta(ge=0, le=100_000)]
    stiffness: AngularStiffness


class RhiSaturation(Strict, frozen=True):
    """Observer, thresholds and duration of transitions, headroom while the posture moves."""

    steepness: Annotated[float, Meta(gt=0.0)]
    leave: Annotated[float, Meta(ge=0.0, le=1.0)]
    come_back: Annotated[float, Meta(ge=0.0, le=1.0)]
    rho: Annotated[float, Meta(ge=0.0)]
    held: Annotated[float, Meta(gt=0.0, le=1.0)]
    moving: Torque
    release: Duration


class RhiWall(Strict, frozen=True):
    """A spring behind a plane."""

    point: Lengths
    normal: tuple[float, ...]
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
