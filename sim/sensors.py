"""What is wrong with the simulated sensors, as a configuration says it."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from ..configs.quantities import (
    Acceleration,
    AngularSpeed,
    DriftTime,
    ErrorAcceleration,
    ErrorAngle,
    ErrorAngularSpeed,
    ErrorForce,
    ErrorTorque,
    Force,
    Torque,
)
from ..configs.strict import Strict

Share = Annotated[float, Meta(ge=0.0, le=0.5, description="of what is measured")]


class SensorError(Strict, frozen=True, kw_only=True):
    """What the sensors of a kind have in common; see ``SensorErrors`` for what the names mean."""

    gain: Share = 0.0
    drift_time: DriftTime = DriftTime(100.0)


class VectorError(SensorError, frozen=True, kw_only=True):
    """Of sensors with several axes in one body."""

    coupling: Share = 0.0


class AngleError(SensorError, frozen=True, kw_only=True):
    """Of encoders; the wire counts in steps of their own."""

    noise: ErrorAngle = ErrorAngle(0.0)
    bias: ErrorAngle = ErrorAngle(0.0)
    drift: ErrorAngle = ErrorAngle(0.0)
    step: ErrorAngle | None = None


class SpeedError(SensorError, frozen=True, kw_only=True):
    """Of the motors' speeds."""

    noise: ErrorAngularSpeed = ErrorAngularSpeed(0.0)
    bias: ErrorAngularSpeed = ErrorAngularSpeed(0.0)
    drift: ErrorAngularSpeed = ErrorAngularSpeed(0.0)
    step: ErrorAngularSpeed | None = None
    range: AngularSpeed | None = None


class LoadError(SensorError, frozen=True, kw_only=True):
    """Of the torque sensors in the joints."""

    noise: ErrorTorque = ErrorTorque(0.0)
    bias: ErrorTorque = ErrorTorque(0.0)
    drift: ErrorTorque = ErrorTorque(0.0)
    step: ErrorTorque | None = None
    range: Torque | None = None


class ForceError(VectorError, frozen=True, kw_only=True):
    """Of the force-torque sensor's forces."""

    noise: ErrorForce = ErrorForce(0.0)
    bias: ErrorForce = ErrorForce(0.0)
    drift: ErrorForce = ErrorForce(0.0)
    step: ErrorForce | None = None
    range: Force | None = None


class TorqueError(VectorError, frozen=True, kw_only=True):
    """Of the force-torque sensor's torques."""

    noise: ErrorTorque = ErrorTorque(0.0)
    bias: ErrorTorque = ErrorTorque(0.0)
    drift: ErrorTorque = ErrorTorque(0.0)
    step: ErrorTorque | None = None
    range: Torque | None = None


class AccelerationError(VectorError, frozen=True, kw_only=True):
    """Of accelerometers."""

    noise: ErrorAcceleration = ErrorAcceleration(0.0)
    bias: ErrorAcceleration = ErrorAcceleration(0.0)
    drift: ErrorAcceleration = ErrorAcceleration(0.0)
    step: ErrorAcceleration | None = None
    range: Acceleration | None = None


class RateError(VectorError, frozen=True, kw_only=True):
    """Of gyroscopes."""

    noise: ErrorAngularSpeed = ErrorAngularSpeed(0.0)
    bias: ErrorAngularSpeed = ErrorAngularSpeed(0.0)
    drift: ErrorAngularSpeed = ErrorAngularSpeed(0.0)
    step: ErrorAngularSpeed | None = None
    range: AngularSpeed | None = None


class Sensors(Strict, frozen=True, kw_only=True):
    """Errors of each kind of sensor; those that are not named measure as they are configured elsewhere."""

    motor_encoder: AngleError | None = None
    motor_speed: SpeedError | None = None
    link_encoder: AngleError | None = None
    load_torque: LoadError | None = None
    force: ForceError | None = None
    torque: TorqueError | None = None
    acceleration: AccelerationError | None = None
    angular_rate: RateError | None = None
