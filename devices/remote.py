"""What the two stations of a telemanipulation tell each other of an arm, beside poses and wrenches."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntFlag
from typing import Final

from .cia301 import Address
from .device import Field, Quantity, Word
from .robot_hand import CURRENT
from .sense_glove import ANGLE, GLOVE_JOINTS


class RemoteFlag(IntFlag):
    """Low byte of a gateway's flags; the high byte counts the acts of the person at that side."""

    ENGAGED = 0x01
    """The arm has power and takes part: it leads (operator) or follows (avatar)."""
    STOPPED = 0x02
    """The arm stopped itself, and waits for an act of the operator."""
    CLUTCHED = 0x04
    """The operator moves the hand without the avatar."""
    TOLD = 0x10
    """The operator's station knows that the arm at the other side does not follow."""
    WAITING = 0x08
    """The arm holds where it is because it hears nothing that it may follow."""
    BEHIND = 0x20
    """The passivity of the link keeps the arm from where it is led."""


ENGAGED: Final = RemoteFlag.ENGAGED.value
STOPPED: Final = RemoteFlag.STOPPED.value
CLUTCHED: Final = RemoteFlag.CLUTCHED.value
WAITING: Final = RemoteFlag.WAITING.value
TOLD: Final = RemoteFlag.TOLD.value
BEHIND: Final = RemoteFlag.BEHIND.value
"""Plain numbers: enum arithmetic is slow."""

ACTS: Final = 256
"""Acts are counted up to here, then from 0 again."""
AGE_STEP: Final = 1e-4
"""Of what the age is counted in [s]."""
UNHEARD: Final = 65535
"""Age, in steps, of a peer that was never heard, or not for so long."""
MOST_DRIVES: Final = 9
"""Of a hand, in a gateway's process data."""
MOST_JOINTS: Final = 7
"""Of an arm, in a gateway's process data."""

OPERATOR_SAYS: Final[Mapping[Address, Field]] = {
    **{(0x2600, i): Quantity("pose") for i in range(1, 8)},
    **{(0x2601, i): Quantity("twist") for i in range(1, 7)},
}
"""Pose (position, quaternion x y z w) and twist of the operator's palm."""
AVATAR_SAYS: Final[Mapping[Address, Field]] = {
    **{(0x2602, i): Quantity("wrench") for i in range(1, 7)},
    **{(0x2603, i): Quantity("joints") for i in range(1, MOST_JOINTS + 1)},
}
"""Wrench on the avatar's palm, and the joints of its arm."""
HEARD: Final[Mapping[Address, Field]] = {
    (0x2610, 0): Word("flags"),
    (0x2611, 0): Quantity("age", AGE_STEP),
    (0x2612, 0): Quantity("energy"),
}
"""Flags and energy of the peer, and how old what it says is."""
GLOVE_SAYS: Final[Mapping[Address, Field]] = {
    (0x2600, i): Quantity("angle", ANGLE) for i in range(1, len(GLOVE_JOINTS) + 1)
}
"""Joints of a glove."""
HAND_SAYS: Final[Mapping[Address, Field]] = {
    (0x2601, i): Quantity("current", CURRENT) for i in range(1, MOST_DRIVES + 1)
}
"""Currents of a hand's motors."""
PILOT_SAYS: Final[Mapping[Address, Field]] = {
    **{(0x2602, i): Quantity("head") for i in range(1, 8)},
    **{(0x2603, i): Quantity("paddle") for i in range(1, 4)},
}
"""Pose of the operator's head, and what the foot does."""
BODY_SAYS: Final[Mapping[Address, Field]] = {
    **{(0x2604, i): Quantity("way") for i in range(1, 7)},
    **{(0x2605, i): Quantity("speed") for i in range(1, 4)},
}
"""Where the avatar's head is, seen from its middle, and how fast its base is."""
HEARD_FLAGS: Final[Mapping[Address, Field]] = {
    (0x2630, 0): Word("flags"),
    (0x2631, 0): Quantity("age", AGE_STEP),
}
"""Flags of a peer that moves no energy, and how old what it says is."""
OWN_FLAGS: Final[Mapping[Address, Field]] = {(0x2640, 0): Word("own_flags")}
"""Flags of this side towards it."""
OWN: Final[Mapping[Address, Field]] = {(0x2620, 0): Word("own_flags"), (0x2622, 0): Quantity("own_energy")}
"""Flags and energy of this side."""


def packed(flags: int, act: int) -> int:
    """The word of flags and number of acts."""
    return flags | (act % ACTS) << 8


def unpacked(word: int) -> tuple[int, int]:
    """Flags and number of acts of a word."""
    return word & 0xFF, word >> 8 & 0xFF
