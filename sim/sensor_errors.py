"""What simulated sensors make of the truth: all of them at once, after the machine has measured itself."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np

from ..devices.force_torque import ForceTorque
from ..models import Array
from .force_torque import SimForceTorque
from .imu import SimImu
from .joint_drive import SimJointDrive
from .node import SimNode
from .sensors import SensorError, Sensors

NONE = SensorError()


class Reading(NamedTuple):
    """A field of a device with its errors, one a component; scales: full scale of each, for coupling."""

    node: SimNode
    field: str
    errors: Sequence[SensorError]
    scales: Sequence[float]


class SensorErrors:
    """Gain, coupling, bias, drift, noise, saturation and steps, in this order, of the sensors of a machine.

    What is constant is drawn when it is made: of every component, gain and bias uniformly within +-``gain``
    (a share) and +-``bias``, and what it picks up of each other axis of its sensor within +-``coupling`` of
    that axis' share of its full scale. ``drift`` is the standard deviation that a first-order process with
    the time constant ``drift_time``, such as temperature, reaches from 0; ``noise`` that of white noise.
    ``range`` is where readings saturate, ``step`` their resolution.
    """

    def __init__(self, nodes: Sequence[SimNode], sensors: Sensors, seed: int) -> None:
        self._random = random = np.random.default_rng([seed, 1])
        self._readings = [reading for node in nodes for reading in _readings(node, sensors)]
        errors = [error for reading in self._readings for error in reading.errors]
        self._noise, self._std = _column(errors, "noise", 0.0), _column(errors, "drift", 0.0)
        self._time = _column(errors, "drift_time", NONE.drift_time)
        self._range, self._step = _column(errors, "range", inf), _column(errors, "step", 0.0)
        self._steps = np.flatnonzero(self._step)
        n = len(errors)
        self._mix = np.diag(1.0 + _column(errors, "gain", 0.0) * random.uniform(-1.0, 1.0, n))
        self._bias = _column(errors, "bias", 0.0) * random.uniform(-1.0, 1.0, n)
        self._drift, self._dt, self._keep, self._stir = np.zeros(n), 0.0, np.ones(n), np.zeros(n)
        at = 0
        for reading in self._readings:
            k = len(reading.errors)
            self._mix[at : at + k, at : at + k] += _coupling(reading, random)
            at += k

    def spoil(self, dt: float) -> None:
        """Replace the truth in the devices by what they would say, dt [s] after the last time."""
        if dt != self._dt:
            self._pace(dt)
        truth: list[float] = []
        for node, field, errors, _ in self._readings:
            value = getattr(node, field)
            truth += value if len(errors) > 1 else (value,)
        stir, noise = self._random.standard_normal((2, len(truth)))
        self._drift *= self._keep
        self._drift += self._stir * stir
        seen = self._mix @ truth + (self._bias + self._drift + self._noise * noise)
        np.clip(seen, -self._range, self._range, seen)
        steps = self._steps
        if steps.size:
            seen[steps] = self._step[steps] * np.rint(seen[steps] / self._step[steps])
        values, at = seen.tolist(), 0
        for node, field, errors, _ in self._readings:
            k = len(errors)
            setattr(node, field, values[at : at + k] if k > 1 else values[at])
            at += k

    def _pace(self, dt: float) -> None:
        """The drift's memory and push for a period: exact for any."""
        self._dt = dt
        self._keep = np.exp(-dt / self._time)
        self._stir = self._std * np.sqrt(1.0 - self._keep**2)


def _readings(node: SimNode, sensors: Sensors) -> list[Reading]:
    """The fields of a device that somebody wants errors of."""
    if isinstance(node, SimJointDrive):
        fields = {
            "position": sensors.motor_encoder,
            "velocity": sensors.motor_speed,
            "link_position": sensors.link_encoder,
            "load_torque": sensors.load_torque,
        }
        return [Reading(node, field, [error], [1.0]) for field, error in fields.items() if error]
    if isinstance(node, SimForceTorque) and (sensors.force or sensors.torque):
        device = node.device
        assert isinstance(device, ForceTorque)
        errors = [sensors.force or NONE] * 3 + [sensors.torque or NONE] * 3
        return [Reading(node, "wrench", errors, [device.force] * 3 + [device.torque] * 3)]
    if isinstance(node, SimImu):
        axes = {"acceleration": sensors.acceleration, "angular_velocity": sensors.angular_rate}
        return [Reading(node, field, [error] * 3, [1.0] * 3) for field, error in axes.items() if error]
    return []


def _column(errors: Sequence[SensorError], key: str, absent: float) -> Array:
    """One key of all errors."""
    values: list[Any] = [getattr(error, key, None) for error in errors]
    return np.array([absent if value is None else value for value in values], float)


def _coupling(reading: Reading, random: np.random.Generator) -> Array:
    """What each component picks up of the others, (k, k)."""
    k, scales = len(reading.errors), np.array(reading.scales)
    share = _column(reading.errors, "coupling", 0.0)[:, None] * random.uniform(-1.0, 1.0, (k, k))
    np.fill_diagonal(share, 0.0)
    found: Array = share * scales[:, None] / scales
    return found
