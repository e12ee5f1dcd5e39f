"""Torque-controlled joints of an arm, as its force control and its stops take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...control.limits import Limits
from ...runtime.core.torque_axes import TorqueAxes


@dataclass(frozen=True, slots=True)
class Ratings:
    """One entry a joint [rad or m, s, N m or N].

    Attributes:
        axes: what the safety layers hold the joints to.
        stiffness: of the spring between rotor and link, infinite where nothing yields.
        acceleration: limit of the controller.
        p_gain: of the motor-side controller.
    """

    axes: TorqueAxes
    stiffness: Sequence[float]
    acceleration: Sequence[float]
    p_gain: Sequence[float]

    @property
    def limits(self) -> Limits:
        """For the force control."""
        axes = self.axes
        values = (axes.lower, axes.upper, axes.velocity, self.acceleration)
        return Limits(*(np.array(value, float) for value in values))

    @property
    def braking(self) -> float:
        """How long the slowest joint takes to brake from full speed [s]."""
        return max(v / a for v, a in zip(self.axes.velocity, self.acceleration, strict=True))

    @property
    def play(self) -> tuple[float, ...]:
        """What spring and position gain yield under a joint's whole torque."""
        rows = zip(self.axes.most, self.stiffness, self.p_gain, strict=True)
        return tuple(torque / k + torque / p for torque, k, p in rows)
