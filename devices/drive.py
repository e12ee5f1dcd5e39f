"""The two kinds of drives: series-elastic joints in torque mode, and linear axes in velocity mode."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .cia301 import Address
from .cia402 import MODE
from .device import Device, Field, Quantity, Word
from .dictionary import Value
from .errors import NetworkError
from .image import ProcessImage

ERROR_CODE: Final = (0x603F, 0)
CONTROLWORD: Final = (0x6040, 0)
STATUSWORD: Final = (0x6041, 0)
MODE_DISPLAY: Final = (0x6061, 0)
POSITION: Final = (0x6064, 0)
VELOCITY: Final = (0x606C, 0)
TARGET_TORQUE: Final = (0x6071, 0)
RATED_TORQUE: Final = (0x6076, 0)
TORQUE: Final = (0x6077, 0)
ENCODER_INCREMENTS: Final = (0x608F, 1)
ENCODER_TURNS: Final = (0x608F, 2)
GEAR_MOTOR_TURNS: Final = (0x6091, 1)
GEAR_SHAFT_TURNS: Final = (0x6091, 2)
TARGET_VELOCITY: Final = (0x60FF, 0)
LINK_POSITION: Final = (0x2200, 0)
LINK_INCREMENTS: Final = (0x2201, 0)
COUNTS_PER_METRE: Final = (0x2203, 0)

CYCLIC_SYNCHRONOUS_VELOCITY: Final = 9
CYCLIC_SYNCHRONOUS_TORQUE: Final = 10
PERMILLE: Final = 1e-3


@dataclass(frozen=True, kw_only=True)
class JointDrive(Device):
    """A series-elastic joint in cyclic synchronous torque mode.

    Attributes:
        counts_per_turn: motor encoder increments per turn of the motor (608Fh).
        gear_ratio: turns of the motor and of the joint that belong together (6091h).
        link_counts_per_turn: link encoder increments per turn of the joint (2201h).
        rated_torque: of the joint, in whole mN m; torques travel in permille of it (6076h) [N m].
        sign: -1 where the drive counts against the joint's positive direction.
        zero: joint angle at position 0 of the motor encoder [rad].
        link_zero: joint angle at position 0 of the link encoder [rad].
    """

    group: str = "joints"
    eds: str = "joint_drive.eds"
    counts_per_turn: int
    gear_ratio: tuple[int, int]
    link_counts_per_turn: int
    rated_torque: float
    sign: int = 1
    zero: float = 0.0
    link_zero: float = 0.0

    def __post_init__(self) -> None:
        _require(self.name, self.sign in (-1, 1), f"sign is {self.sign}; write 1 or -1")
        positive = min(self.counts_per_turn, *self.gear_ratio, self.link_counts_per_turn, self.rated_torque)
        _require(self.name, positive > 0, "counts, gear ratio and rated torque must be positive")

    def inputs(self) -> Mapping[Address, Field]:
        """Motor and link side in joint angles, load torque, and the drive's state."""
        motor, shaft = self.gear_ratio
        radians = self.sign * 2.0 * math.pi / self.counts_per_turn * shaft / motor
        link_radians = self.sign * 2.0 * math.pi / self.link_counts_per_turn
        return {
            STATUSWORD: Word("statusword"),
            MODE_DISPLAY: Word("mode"),
            POSITION: Quantity("position", radians, self.zero),
            LINK_POSITION: Quantity("link_position", link_radians, self.link_zero),
            VELOCITY: Quantity("velocity", radians),
            TORQUE: Quantity("load_torque", self.sign * self.rated_torque * PERMILLE),
            ERROR_CODE: Word("error_code"),
        }

    def outputs(self) -> Mapping[Address, Field]:
        """Controlword and joint torque."""
        return {
            CONTROLWORD: Word("controlword"),
            TARGET_TORQUE: Quantity("target_torque", self.sign * self.rated_torque * PERMILLE),
        }

    def settings(self) -> Mapping[Address, Value]:
        """The mode of operation."""
        return {MODE: CYCLIC_SYNCHRONOUS_TORQUE}

    def facts(self) -> Mapping[Address, Value]:
        """The scaling that the fields rely on."""
        return {
            RATED_TORQUE: round(self.rated_torque * 1000.0),
            ENCODER_INCREMENTS: self.counts_per_turn,
            ENCODER_TURNS: 1,
            GEAR_MOTOR_TURNS: self.gear_ratio[0],
            GEAR_SHAFT_TURNS: self.gear_ratio[1],
            LINK_INCREMENTS: self.link_counts_per_turn,
        }


@dataclass(frozen=True, kw_only=True)
class AxisDrive(Device):
    """A linear axis in cyclic synchronous velocity mode.

    Attributes:
        counts_per_metre: position increments per metre (2203h); velocities are increments per second.
        sign: -1 where the drive counts against the axis' positive direction.
        zero: position of the axis at position 0 of the encoder [m].
    """

    group: str = "axes"
    eds: str = "axis_drive.eds"
    counts_per_metre: int
    sign: int = 1
    zero: float = 0.0

    def __post_init__(self) -> None:
        _require(self.name, self.sign in (-1, 1), f"sign is {self.sign}; write 1 or -1")
        _require(self.name, self.counts_per_metre > 0, "counts_per_metre must be positive")

    def inputs(self) -> Mapping[Address, Field]:
        """Position [m], velocity [m/s], and the drive's state."""
        metres = self.sign / self.counts_per_metre
        return {
            STATUSWORD: Word("statusword"),
            MODE_DISPLAY: Word("mode"),
            POSITION: Quantity("position", metres, self.zero),
            VELOCITY: Quantity("velocity", metres),
            ERROR_CODE: Word("error_code"),
        }

    def outputs(self) -> Mapping[Address, Field]:
        """Controlword and velocity."""
        return {
            CONTROLWORD: Word("controlword"),
            TARGET_VELOCITY: Quantity("target_velocity", self.sign / self.counts_per_metre),
        }

    def settings(self) -> Mapping[Address, Value]:
        """The mode of operation."""
        return {MODE: CYCLIC_SYNCHRONOUS_VELOCITY}

    def facts(self) -> Mapping[Address, Value]:
        """The scaling that the fields rely on."""
        return {COUNTS_PER_METRE: self.counts_per_metre}


class JointDrives:
    """The joint drives of a group as arrays, one entry per drive; write to `target_torque`.

    Attributes:
        position: (n,) joint angle by the motor encoder [rad].
        link_position: (n,) joint angle by the link encoder [rad].
        velocity: (n,) of the motor, in joint angles [rad/s].
        load_torque: (n,) by the torque sensor, joint side [N m].
        statusword, mode, error_code: (n,) 6041h, 6061h, 603Fh.
        controlword: (n,) 6040h; `PowerStage` writes it.
        target_torque: (n,) of the joint [N m].
    """

    def __init__(self, image: ProcessImage, group: str = "joints") -> None:
        self.position: NDArray[np.float64] = image[f"{group}.position"]
        self.link_position: NDArray[np.float64] = image[f"{group}.link_position"]
        self.velocity: NDArray[np.float64] = image[f"{group}.velocity"]
        self.load_torque: NDArray[np.float64] = image[f"{group}.load_torque"]
        self.statusword: NDArray[np.uint32] = image.word(f"{group}.statusword")
        self.mode: NDArray[np.uint32] = image.word(f"{group}.mode")
        self.error_code: NDArray[np.uint32] = image.word(f"{group}.error_code")
        self.controlword: NDArray[np.uint32] = image.word(f"{group}.controlword")
        self.target_torque: NDArray[np.float64] = image[f"{group}.target_torque"]


class AxisDrives:
    """The linear axes of a group as arrays, one entry per drive; write to `target_velocity`.

    Attributes:
        position: (n,) [m].
        velocity: (n,) [m/s].
        statusword, mode, error_code: (n,) 6041h, 6061h, 603Fh.
        controlword: (n,) 6040h; `PowerStage` writes it.
        target_velocity: (n,) [m/s].
    """

    def __init__(self, image: ProcessImage, group: str = "axes") -> None:
        self.position: NDArray[np.float64] = image[f"{group}.position"]
        self.velocity: NDArray[np.float64] = image[f"{group}.velocity"]
        self.statusword: NDArray[np.uint32] = image.word(f"{group}.statusword")
        self.mode: NDArray[np.uint32] = image.word(f"{group}.mode")
        self.error_code: NDArray[np.uint32] = image.word(f"{group}.error_code")
        self.controlword: NDArray[np.uint32] = image.word(f"{group}.controlword")
        self.target_velocity: NDArray[np.float64] = image[f"{group}.target_velocity"]


def _require(device: str, condition: bool, reason: str) -> None:
    if not condition:
        raise NetworkError(device, reason)
