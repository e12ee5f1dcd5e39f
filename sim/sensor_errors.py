"""What simulated sensors make of the truth: all of them at once, after the machine has measured itself."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np

from ..binding import bind
from ..devices.force_torque import ForceTorque
from ..models import Array
from ._plant import ffi, lib
from .force_torque import SimForceTorque
from .imu import SimImu
from .joint_drive import SimJointDrive
from .node import SimNode
from .sensors import SensorError, Sensors

NONE = SensorError()
AHEAD = 32
"""Ticks for which errors are drawn at once; so soon even the fastest drift does not fade beyond a double."""


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
        readings = [reading for node in nodes for reading in _readings(node, sensors)]
        errors = [error for reading in readings for error in reading.errors]
        self._noise, self._std = _column(errors, "noise", 0.0), _column(errors, "drift", 0.0)
        self._time = _column(errors, "drift_time", NONE.drift_time)
        n = len(errors)
        self._mix = np.diag(1.0 + _column(errors, "gain", 0.0) * random.uniform(-1.0, 1.0, n))
        self._bias = _column(errors, "bias", 0.0) * random.uniform(-1.0, 1.0, n)
        self._drift = np.zeros(n)
        self._pace(0.0)
        self._offset, self._left = np.zeros((AHEAD, n)), 0
        self._truth, self._seen = np.zeros(n), np.zeros(n)
        end = 0
        for reading in readings:
            own = slice(end, end := end + len(reading.errors))
            self._mix[own, own] += _coupling(reading, random)
        self._core = self._bound(readings, errors)

    def _bound(self, readings: Sequence[Reading], errors: Sequence[SensorError]) -> Any:
        """What C works on."""
        fields = ffi.new("sensor_field[]", [{"n": len(reading.errors)} for reading in readings])
        for i, reading in enumerate(readings):
            bind(lib, fields, {}, i, value=reading.node.fields[reading.field])
        core = ffi.new("sensor_errors *", {"n": len(errors), "count": len(fields), "ahead": AHEAD})
        bind(
            lib,
            core,
            field=fields,
            truth=self._truth,
            seen=self._seen,
            range=_column(errors, "range", inf),
            step=_column(errors, "step", 0.0),
            offset=self._offset,
        )
        return core

    def spoil(self, dt: float) -> None:
        """Replace the truth in the devices by what they would say, dt [s] after the last time."""
        if dt != self._dt or not self._left:
            self._draw(dt)
        self._left -= 1
        lib.sensor_errors_take(self._core)
        np.dot(self._mix, self._truth, out=self._seen)
        lib.sensor_errors_give(self._core)

    def _draw(self, dt: float) -> None:
        """What bias, drift and noise add in the next periods of dt [s]."""
        if dt != self._dt:
            self._pace(dt)
        stir, noise = self._random.standard_normal((2, AHEAD, len(self._drift)))
        # d' = keep d + push, summed up
        drift = self._fade * (self._drift + np.cumsum(self._push * stir / self._fade, axis=0))
        self._drift = drift[-1]
        self._offset[:] = self._bias + drift + self._noise * noise
        self._left, self._core.next = AHEAD, 0

    def _pace(self, dt: float) -> None:
        """How drifts fade and wander in periods of dt [s]."""
        keep = np.exp(-dt / self._time)
        self._dt, self._push = dt, self._std * np.sqrt(1.0 - keep**2)
        self._fade = keep ** np.arange(1, AHEAD + 1)[:, None]


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
