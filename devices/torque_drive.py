"""What drives of joints have in common, whether they turn or slide: a motor in torque mode with a gear."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Final

from msgspec import Meta

from ..configs.quantities import PeakTime, Torque
from .cia301 import Address
from .cia402 import (
    CONTROLWORD,
    CYCLIC_SYNCHRONOUS_TORQUE,
    ENCODER_INCREMENTS,
    ENCODER_TURNS,
    ERROR_CODE,
    GEAR_MOTOR_TURNS,
    GEAR_SHAFT_TURNS,
    MAX_TORQUE,
    MODE,
    MODE_DISPLAY,
    POSITION,
    RATED_TORQUE,
    STATUSWORD,
    TARGET_TORQUE,
    TORQUE,
    VELOCITY,
)
from .device import Device, Field, Finding, Quantity, Sign, Word
from .dictionary import Value
from .group import Group, Quantities, Words

LINK_POSITION: Final = (0x2200, 0)
LINK_INCREMENTS: Final = (0x2201, 0)
PEAK_TIME: Final = (0x2202, 0)
PERMILLE: Final = 1e-3
TURNS: Final = 2.0
"""That an encoder must be able to count to: no joint turns further from its zero than one."""
HIGHEST_PEAK: Final = 32.767
"""Peak torque in multiples of the rated one: what the INT16 of the wire carries."""
COARSEST: Final = 1000
"""Counts a turn of the shaft: a controller differentiates them."""

CountsPerTurn = Annotated[
    int, Meta(ge=64, le=2**30 - 1, description="coarser is no encoder; two turns fit into 32 bits")
]
Teeth = Annotated[int, Meta(ge=1, le=10**5, description="teeth of a gear, or its ratio as a fraction")]


class TorqueDrive(Device, frozen=True, kw_only=True):
    """A motor with a gear in cyclic synchronous torque mode, and an encoder on its shaft.

    Attributes:
        counts_per_turn: motor encoder increments per turn of the motor (608Fh).
        gear_ratio: turns of the motor and of the shaft that belong together (6091h).
        link_counts_per_turn: encoder increments per turn of the shaft (2201h).
        rated_torque: of the shaft, in whole mN m; torques travel in permille of it (6076h) [N m].
        peak_torque: that it may give for ``peak_time`` (6072h, 2202h); both or neither [N m, s].
        sign: -1 where the drive counts against the joint's positive direction.
        zero: position of the joint at position 0 of the motor encoder [rad or m].
        link_zero: position of the joint at position 0 of the encoder on the shaft [rad or m].
    """

    group: str = "joints"
    eds: str = "joint_drive.eds"
    counts_per_turn: CountsPerTurn
    gear_ratio: tuple[Teeth, Teeth]
    link_counts_per_turn: CountsPerTurn
    rated_torque: Torque
    peak_torque: Torque | None = None
    peak_time: PeakTime | None = None
    sign: Sign = 1
    zero: float = 0.0
    link_zero: float = 0.0

    def __post_init__(self) -> None:
        self.require(self.sign in (-1, 1), f"sign is {self.sign}; write 1 or -1")
        positive = min(
            self.travel, self.counts_per_turn, *self.gear_ratio, self.link_counts_per_turn, self.rated_torque
        )
        self.require(positive > 0, "counts, gear ratio and rated torque must be positive")

    @property
    def travel(self) -> float:
        """Way of the joint in a turn of the shaft [rad or m]."""
        return 2.0 * math.pi

    @property
    def rated(self) -> float:
        """What the joint gives at the rated torque of the shaft [N m or N]."""
        return self.rated_torque * 2.0 * math.pi / self.travel

    @property
    def peak(self) -> float:
        """What the joint gives for ``peak_time``, 0 where that is no more than for ever [N m or N]."""
        return (self.peak_torque or 0.0) * 2.0 * math.pi / self.travel

    def inputs(self) -> Mapping[Address, Field]:
        """Motor and link side as the joint moves, load torque, and the drive's state."""
        motor, shaft = self.gear_ratio
        way = self.sign * self.travel / self.counts_per_turn * shaft / motor
        link_way = self.sign * self.travel / self.link_counts_per_turn
        return {
            STATUSWORD: Word("statusword"),
            MODE_DISPLAY: Word("mode"),
            POSITION: Quantity("position", way, self.zero),
            LINK_POSITION: Quantity("link_position", link_way, self.link_zero),
            VELOCITY: Quantity("velocity", way),
            TORQUE: Quantity("load_torque", self.sign * self.rated * PERMILLE),
            ERROR_CODE: Word("error_code"),
        }

    def outputs(self) -> Mapping[Address, Field]:
        """Controlword and torque or force of the joint."""
        return {
            CONTROLWORD: Word("controlword"),
            TARGET_TORQUE: Quantity("target_torque", self.sign * self.rated * PERMILLE),
        }

    def settings(self) -> Mapping[Address, Value]:
        """The mode of operation."""
        return {MODE: CYCLIC_SYNCHRONOUS_TORQUE}

    def facts(self) -> Mapping[Address, Value]:
        """The scaling that the fields rely on."""
        peak: dict[Address, Value] = {}
        if self.peak_torque and self.peak_time:
            permille = self.peak_torque / (self.rated_torque * PERMILLE)
            peak = {MAX_TORQUE: round(permille), PEAK_TIME: round(self.peak_time * 1000.0)}
        return {
            **peak,
            RATED_TORQUE: round(self.rated_torque * 1000.0),
            ENCODER_INCREMENTS: self.counts_per_turn,
            ENCODER_TURNS: 1,
            GEAR_MOTOR_TURNS: self.gear_ratio[0],
            GEAR_SHAFT_TURNS: self.gear_ratio[1],
            LINK_INCREMENTS: self.link_counts_per_turn,
        }

    def check(self) -> list[Finding]:
        """Encoders with too few counts, seen from the joint, or too many for 6064h; a peak that is none."""
        motor, shaft = self.gear_ratio
        counts = self.counts_per_turn * motor / shaft
        found = []
        if TURNS * counts >= 2**31:
            problem = f"{counts:g} counts a turn of the shaft leave 32 bits within {TURNS:g} turns"
            found.append(("counts_per_turn", problem, "lower it, or the gear ratio"))
        for key, have in (("counts_per_turn", counts), ("link_counts_per_turn", self.link_counts_per_turn)):
            if have < COARSEST:
                found.append((key, f"{have:g} counts a turn of the shaft", f"give {COARSEST} or more"))
        return found + self._check_peak()

    def _check_peak(self) -> list[Finding]:
        peak, rated = self.peak_torque, self.rated_torque
        if (peak is None) != (self.peak_time is None):
            key, other = ("peak_time", "peak_torque") if peak else ("peak_torque", "peak_time")
            return [(key, f"is missing, but there is a {other}", f"give it, or remove {other}")]
        if peak is not None and not rated < peak <= HIGHEST_PEAK * rated:
            problem = f"{peak:g} N m beside a rated torque of {rated:g} N m"
            fix = f"give more than that, and at most {HIGHEST_PEAK:g} times as much"
            return [("peak_torque", problem, fix)]
        return []


class JointDrives(Group):
    """The drives of joints of a group as arrays, one entry per drive; what slides has metres and newtons.

    Attributes:
        position: (n,) joint angle by the motor encoder [rad].
        link_position: (n,) joint angle by the link encoder [rad].
        velocity: (n,) of the motor, in joint angles [rad/s].
        load_torque: (n,) by the torque sensor, joint side [N m].
        statusword, mode, error_code: (n,) 6041h, 6061h, 603Fh.
        controlword: (n,) 6040h; `PowerStage` writes it.
        target_torque: (n,) of the joint as it is encoded; read only [N m].
    """

    kind = TorqueDrive
    position: Quantities
    link_position: Quantities
    velocity: Quantities
    load_torque: Quantities
    statusword: Words
    mode: Words
    error_code: Words
    controlword: Words
    target_torque: Quantities
