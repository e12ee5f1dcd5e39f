"""Motors in torque mode with an encoder on either side: what the safety layers hold them to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from ...devices.device import Device
from ...devices.image import ProcessImage
from ...devices.torque_drive import JointDrives, TorqueDrive
from ...safety import Axes, AxisLimits, Balance, Heat, Pairs, Peak, Springs, Thresholds
from ...safety.heat import PLANNED
from .machine import GATE_SHARE, SPEED_MARGIN
from .measured import Array, axes
from .sections import Config

CONTRADICTION = 0.1
"""Part of a spring's deflection under the axis' largest torque by which its encoders and its torque sensor
may contradict each other (row 11): what such torque sensors are good for."""
ENCODERS = 0.04
"""Part of the margin behind an axis' limits by which its encoders may contradict its torque sensor all the
same, however stiff the spring: eccentric discs and uneven gears turn by some tenths of a milliradian less or
more than they should, and half of this must be enough for them."""
RUB = 0.1
"""Part of the torque that a gear carries which its friction may take besides a contradiction."""
ROTOR_DOUBT = 0.3
"""Share by which a rotor's inertia may be another than the controller believes."""
LEARNT = 0.5
"""Part of a contradiction by which a deflection, and within a block of ticks its torque, may be off where
something is learnt of its spring."""
EASING = 0.5
"""Share of the believed stiffness by which its estimate may change in a second."""
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
        velocity, torque: largest magnitudes; of a motor that may give more for a time, the torque for ever.
        stiffness: of the spring behind each motor, infinite where nothing yields; None where none does.
        margin: behind the limits, where the monitor stops the machine; None: the configuration's for all.
        rotor: inertias before the springs, as the joints see them; None where nothing yields.
        doubt: share by which the stiffness may be another.
        peaks: what each may give for a time; None where that is no more, or nowhere.
        acceleration: that its torque gives each, or more; None: see ``axes``.
    """

    names: Sequence[str]
    lower: Sequence[float]
    upper: Sequence[float]
    velocity: Sequence[float]
    torque: Sequence[float]
    stiffness: Sequence[float] | None = None
    margin: Sequence[float] | None = None
    rotor: Sequence[float] | None = None
    doubt: float = 0.0
    peaks: Sequence[Peak | None] | None = None
    acceleration: Sequence[float] | None = None

    def margins(self, config: Config) -> Sequence[float]:
        """One a motor."""
        return self.margin or [config.safety.position_margin] * len(self.names)

    def limits(self, config: Config) -> tuple[AxisLimits, ...]:
        """For the gate. A motor may take its whole torque at once: meeting a limit does; the drive slews."""
        peaks = self.peaks or [None] * len(self.names)
        rows = zip(
            *(self.names, self.torque, self.velocity, self.lower, self.upper, self.margins(config), peaks),
            strict=True,
        )
        return tuple(
            AxisLimits(
                name,
                torque,
                inf,
                torque * velocity,
                low - GATE_SHARE * margin,
                high + GATE_SHARE * margin,
                peak,
            )
            for name, torque, velocity, low, high, margin, peak in rows
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
        return tuple(torque / k / SWING_S for torque, k in zip(self.most, stiffness, strict=True))

    @property
    def most(self) -> tuple[float, ...]:
        """What each motor may ever give."""
        peaks = self.peaks or [None] * len(self.names)
        rows = zip(self.torque, peaks, strict=True)
        return tuple(max(torque, peak.torque) if peak else torque for torque, peak in rows)

    def heat(self, image: ProcessImage, dt: float) -> Heat:
        """Budgets of the motors, as their controller plans with them; it is a check's to take each tick."""
        told = JointDrives(image).target_torque
        return Heat(told, self.torque, self.peaks or [None] * len(self.names), PLANNED, dt)

    @property
    def believed(self) -> Array:
        """Stiffness of the springs, infinite where nothing yields, (n,)."""
        return np.array(self.stiffness or [inf] * len(self.names), float)

    def checks(
        self,
        config: Config,
        image: ProcessImage,
        balance: Array | None = None,
        stiffness: Array | None = None,
        heat: Heat | None = None,
    ) -> Axes:
        """For the plausibility of what they measure.

        Args:
            config: of the machine.
            image: its devices.
            balance: torques that balance what the motors are told, (n,); None: the measured loads.
            stiffness: where estimates of the springs' are written, (n,); None: nowhere.
            heat: budgets of the motors, for whoever plans with them.
        """
        drives, n, dt = JointDrives(image), len(self.names), 1.0 / config.loop.rate
        stiff = self.believed if stiffness is None else stiffness
        compliance = (1.0 / stiff).tolist()
        rows = zip(self.torque, compliance, self.margins(config), strict=True)
        yields = [max(CONTRADICTION * most * c, ENCODERS * margin) if c else 0.0 for most, c, margin in rows]
        frozen = [FROZEN_LOAD * most for most in self.torque], [0.5 * way or inf for way in yields]
        elastic = max(compliance) > 0.0
        found = axes(
            image,
            "joints",
            self.velocity,
            {"position": [0.0] * n, "link_position": yields},
            (drives.target_torque, self.torque, drives.load_torque if balance is None else balance),
            dt,
            ("link_position", drives.load_torque, compliance) if elastic else None,
            self.acceleration,
        )
        # where nothing yields: beyond this the gate would judge positions that are none
        apart = [
            most or GATE_SHARE * margin for most, margin in zip(yields, self.margins(config), strict=True)
        ]
        torques = self._torques(drives, found.values[0].age, stiff, yields, dt) if elastic else None
        pairs = Pairs(
            *(drives.position, drives.link_position, drives.load_torque, compliance, apart),
            frozen if elastic else None,
            RELAXING_S / dt,
            torques[1].bounds if torques else None,
        )
        found = replace(found, pairs=[pairs], heats=[heat] if heat and self.peaks else [])
        return replace(found, balances=[torques[0]], springs=[torques[1]]) if torques else found

    def _torques(
        self,
        drives: JointDrives,
        age: NDArray[np.int32],
        stiffness: Array,
        yields: Sequence[float],
        dt: float,
    ) -> tuple[Balance, Springs]:
        """What motors give beside what their springs carry, and what both say of these."""
        assert self.rotor is not None
        contradiction = [CONTRADICTION * most for most in self.torque]
        balance = Balance(
            *(drives.target_torque, drives.load_torque, drives.velocity, age, self.rotor, contradiction),
            *(ROTOR_DOUBT, RUB, dt),
        )
        springs = Springs(
            *(drives.position, drives.link_position, drives.load_torque, balance, stiffness, self.doubt),
            [LEARNT * way for way in yields],
            [LEARNT * torque for torque in contradiction],
            RELAXING_S / dt,
            EASING * dt,
        )
        return balance, springs


def peaks_of(devices: Mapping[str, Device], names: Sequence[str]) -> list[Peak | None] | None:
    """What drives by these names may give for a time; None where none may give more than for ever."""
    drives = [devices.get(name) for name in names]
    peaks = [
        Peak(drive.rated, drive.peak, drive.peak_time)
        if isinstance(drive, TorqueDrive) and drive.peak_time
        else None
        for drive in drives
    ]
    return peaks if any(peaks) else None


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
