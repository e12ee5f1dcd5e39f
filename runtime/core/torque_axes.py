"""Motors in torque mode with an encoder on either side: what the safety layers hold them to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isinf

from ...devices.image import ProcessImage
from ...devices.torque_drive import JointDrives
from ...safety import Axes, AxisLimits, Pairs, Thresholds
from .machine import GATE_SHARE, SPEED_MARGIN
from .measured import Array, axes
from .sections import Config

CONTRADICTION = 0.1
"""Part of a spring's deflection under the axis' largest torque by which its encoders and its torque sensor
may contradict each other (row 11): what such torque sensors are good for."""
FROZEN_LOAD = 0.01
"""Part of an axis' largest torque within which its torque sensor stands still; its spring must not give by
half a contradiction meanwhile."""


RELAXING_S = 2e-3
"""By so long the deflection of a spring may lag behind the torque through it: what damps it carries, too."""
SWING_S = 20e-3
"""Time in which a spring takes the whole torque of its motor."""


@dataclass(frozen=True, slots=True)
class TorqueAxes:
    """What a machine's motors may do, one entry each [rad or m, s, N m or N].

    Attributes:
        names: of the drives.
        lower, upper: limits of the controller.
        velocity, torque: largest magnitudes.
        stiffness: of the spring behind each motor, infinite where nothing yields; None where none does.
        margin: behind the limits, where the monitor stops the machine; None: the configuration's for all.
    """

    names: Sequence[str]
    lower: Sequence[float]
    upper: Sequence[float]
    velocity: Sequence[float]
    torque: Sequence[float]
    stiffness: Sequence[float] | None = None
    margin: Sequence[float] | None = None

    def margins(self, config: Config) -> Sequence[float]:
        """One a motor."""
        return self.margin or [config.safety.position_margin] * len(self.names)

    def limits(self, config: Config) -> tuple[AxisLimits, ...]:
        """For the gate. A motor may take its whole torque at once: meeting a limit does; the drive slews."""
        rows = zip(
            *(self.names, self.torque, self.velocity, self.lower, self.upper, self.margins(config)),
            strict=True,
        )
        return tuple(
            AxisLimits(
                name, torque, inf, torque * velocity, low - GATE_SHARE * margin, high + GATE_SHARE * margin
            )
            for name, torque, velocity, low, high, margin in rows
        )

    def thresholds(self, config: Config, image: ProcessImage) -> Thresholds:
        """For the monitor."""
        ranges = self.lower, self.upper
        swing = self.swing
        return thresholds(config, image, self.names, ranges, self.margins(config), self.velocity, swing)

    @property
    def swing(self) -> tuple[float, ...]:
        """How much faster than its link a motor may turn, because the spring between them gives."""
        stiffness = self.stiffness or [inf] * len(self.names)
        return tuple(torque / k / SWING_S for torque, k in zip(self.torque, stiffness, strict=True))

    def checks(self, config: Config, image: ProcessImage, balance: Array | None = None) -> Axes:
        """For the plausibility of what they measure.

        Args:
            config: of the machine.
            image: its devices.
            balance: torques that balance what the motors are told, (n,); None: the measured loads.
        """
        drives, n = JointDrives(image), len(self.names)
        stiffness = self.stiffness or [inf] * n
        compliance = [1.0 / k for k in stiffness]
        yields = [CONTRADICTION * most * c for most, c in zip(self.torque, compliance, strict=True)]
        # where nothing yields: beyond this the gate would judge positions that are none
        apart = [
            GATE_SHARE * margin if isinf(k) else most
            for k, most, margin in zip(stiffness, yields, self.margins(config), strict=True)
        ]
        stuck = [FROZEN_LOAD * most for most in self.torque], [0.5 * way or inf for way in yields]
        frozen = None if all(map(isinf, stiffness)) else stuck
        pairs = Pairs(
            *(drives.position, drives.link_position, drives.load_torque, compliance, apart, frozen),
            RELAXING_S * config.loop.rate,
        )
        return axes(
            image,
            "joints",
            self.velocity,
            {"position": [0.0] * n, "link_position": yields},
            (drives.target_torque, self.torque, drives.load_torque if balance is None else balance),
            1.0 / config.loop.rate,
            [pairs],
            ("link_position", drives.load_torque, compliance) if frozen else None,
        )


def thresholds(
    config: Config,
    image: ProcessImage,
    names: Sequence[str],
    ranges: tuple[Sequence[float], Sequence[float]],
    margin: Sequence[float],
    velocity: Sequence[float],
    swing: Sequence[float],
) -> Thresholds:
    """What the monitor compares with.

    Args:
        config: of the machine.
        image: its devices.
        names: of the axes.
        ranges: lower and upper limits of each.
        margin: how far behind them each may get.
        velocity: limit of each.
        swing: how much faster than the axis its motor may turn.
    """
    lower, upper = ranges
    return Thresholds(
        axes=tuple(names),
        lower=tuple(low - most for low, most in zip(lower, margin, strict=True)),
        upper=tuple(high + most for high, most in zip(upper, margin, strict=True)),
        speed=tuple(SPEED_MARGIN * v for v in velocity),
        motor_speed=tuple(SPEED_MARGIN * v + more for v, more in zip(velocity, swing, strict=True)),
        devices=tuple(device.name for device in image.network.devices),
        rate=config.loop.rate,
        overruns_stop=config.loop.on_overrun == "stop",
    )
