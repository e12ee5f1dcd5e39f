"""The safety controller: dead-man switches, emergency stop, scanner, STO; two channels where it matters.

Every bit is 1 when it is safe to move, so that a silent or broken device reads as "stop".
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntFlag
from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .cia301 import Address
from .device import Device, Field, Word
from .image import ProcessImage


class SafetyInput(IntFlag):
    """Bits of 2500h."""

    DEAD_MAN_A = 0x01  # pressed
    DEAD_MAN_B = 0x02
    EMERGENCY_STOP_A = 0x04  # closed, not pressed
    EMERGENCY_STOP_B = 0x08
    SCANNER_CLEAR = 0x10
    TORQUE_PERMITTED_A = 0x20  # STO is not acting
    TORQUE_PERMITTED_B = 0x40
    SUPERVISOR_A = 0x80  # the safety operator's dead-man switch, pressed
    SUPERVISOR_B = 0x100
    OVERRIDE_A = 0x200  # key turned: nobody needs to hold the handle
    OVERRIDE_B = 0x400


class SafetyRequest(IntFlag):
    """Bits of 2501h."""

    STO = 0x01
    RESET = 0x02  # rising edge: acknowledges an STO whose cause is gone


# plain numbers: enum arithmetic is slow, and this is read several times per tick
DEAD_MAN: Final = (SafetyInput.DEAD_MAN_A | SafetyInput.DEAD_MAN_B).value
EMERGENCY_STOP: Final = (SafetyInput.EMERGENCY_STOP_A | SafetyInput.EMERGENCY_STOP_B).value
SCANNER_CLEAR: Final = SafetyInput.SCANNER_CLEAR.value
TORQUE_PERMITTED: Final = (SafetyInput.TORQUE_PERMITTED_A | SafetyInput.TORQUE_PERMITTED_B).value
SUPERVISOR: Final = (SafetyInput.SUPERVISOR_A | SafetyInput.SUPERVISOR_B).value
OVERRIDE: Final = (SafetyInput.OVERRIDE_A | SafetyInput.OVERRIDE_B).value
ALL: Final = DEAD_MAN | EMERGENCY_STOP | SCANNER_CLEAR | TORQUE_PERMITTED | SUPERVISOR | OVERRIDE


GROUP: Final = "safety"
"""Of the safety controllers in the process image."""


class SafetyPlc(Device, frozen=True, kw_only=True, tag="safety_plc"):
    """A safety controller that reads the switches and drives the STO lines."""

    group: str = GROUP
    eds: str = "safety_plc.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Bits of `SafetyInput`."""
        return {(0x2500, 0): Word("inputs")}

    def outputs(self) -> Mapping[Address, Field]:
        """Bits of `SafetyRequest`."""
        return {(0x2501, 0): Word("request")}


class SafetyState(NamedTuple):
    """What the safety controllers say.

    Attributes:
        dead_man: the one at the handle is pressed on both channels.
        emergency_stop: pressed: open on at least one channel.
        field_clear: nobody in the scanned field.
        sto: STO acts on at least one channel.
        supervised: the safety operator's dead-man switch is pressed on both channels.
        overriding: the key that takes the place of the one at the handle is turned, on both channels.
    """

    dead_man: bool
    emergency_stop: bool
    field_clear: bool
    sto: bool
    supervised: bool
    overriding: bool


@cache
def decode(bits: int) -> SafetyState:
    """What bits of ``SafetyInput`` say, no others; there are few that differ."""
    return SafetyState(
        bits & DEAD_MAN == DEAD_MAN,
        bits & EMERGENCY_STOP != EMERGENCY_STOP,
        bits & SCANNER_CLEAR != 0,
        bits & TORQUE_PERMITTED != TORQUE_PERMITTED,
        bits & SUPERVISOR == SUPERVISOR,
        bits & OVERRIDE == OVERRIDE,
    )


class SafetySignals:
    """What the safety controllers of a group say together: safe only if all of them say so."""

    def __init__(self, image: ProcessImage, group: str = GROUP) -> None:
        self._inputs: NDArray[np.uint32] = image.word(f"{group}.inputs")
        self._request: NDArray[np.uint32] = image.word(f"{group}.request")

    def state(self) -> SafetyState:
        """What all controllers agree on."""
        bits: int = ALL
        for word in self._inputs.tolist():
            bits &= word
        return decode(bits)

    def request(self, bits: SafetyRequest) -> None:
        """Sets the request byte of all controllers of the group."""
        self._request[:] = int(bits)
