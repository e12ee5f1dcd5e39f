"""What the two stations of a telemanipulation tell each other of an arm, beside poses and wrenches."""

from __future__ import annotations

from enum import IntFlag
from typing import Final


class RemoteFlag(IntFlag):
    """Low byte of a gateway's flags; the high byte counts the acts of the person at that side."""

    ENGAGED = 0x01
    """The arm has power and takes part: it leads (operator) or follows (avatar)."""
    STOPPED = 0x02
    """The arm stopped itself, and waits for an act of the operator."""
    CLUTCHED = 0x04
    """The operator moves the hand without the avatar."""
    WAITING = 0x08
    """The arm holds where it is because it hears nothing that it may follow."""


ENGAGED: Final = RemoteFlag.ENGAGED.value
STOPPED: Final = RemoteFlag.STOPPED.value
CLUTCHED: Final = RemoteFlag.CLUTCHED.value
WAITING: Final = RemoteFlag.WAITING.value
"""Plain numbers: enum arithmetic is slow."""

ACTS: Final = 256
"""Acts are counted up to here, then from 0 again."""
AGE_STEP: Final = 1e-4
"""Of what the age is counted in [s]."""
UNHEARD: Final = 65535
"""Age, in steps, of a peer that was never heard, or not for so long."""
MOST_JOINTS: Final = 7
"""Of an arm, in a gateway's process data."""


def packed(flags: int, act: int) -> int:
    """The word of flags and number of acts."""
    return flags | (act % ACTS) << 8


def unpacked(word: int) -> tuple[int, int]:
    """Flags and number of acts of a word."""
    return word & 0xFF, word >> 8 & 0xFF
