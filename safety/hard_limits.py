"""Limits that measurements of axes must keep, compared all at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..binding import bind
from ._plausibility import ffi, lib
from .observation import Thresholds


class HardLimits:
    """Position, velocity and speed by the way of n axes."""

    def __init__(self, thresholds: Thresholds) -> None:
        self._n = n = len(thresholds.axes)
        self._position, self._velocity, self._way = (ffi.new("double[]", n) for _ in range(3))
        self._core = ffi.new("hard_limits *", {"n": n})
        bind(
            lib,
            self._core,
            lower=np.array(thresholds.lower, float),
            upper=np.array(thresholds.upper, float),
            motor_speed=np.array(thresholds.motor_speed, float),
            speed=np.array(thresholds.speed, float),
            position=self._position,
            velocity=self._velocity,
            way=self._way,
        )

    def kept(self, position: Sequence[float], velocity: Sequence[float], way: Sequence[float]) -> bool:
        """Whether every axis is within its limits; one of which a measurement is a NaN is not.

        Args:
            position: measured, one an axis.
            velocity: likewise.
            way: speed by the way that it went lately, likewise.

        Raises:
            ValueError: not one number an axis.
        """
        n = self._n
        self._position[0:n], self._velocity[0:n], self._way[0:n] = position, velocity, way
        return bool(lib.hard_limits_kept(self._core))
