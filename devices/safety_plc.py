"""The safety controller: dead-man, emergency stop, scanner and STO, all in two channels where it matters.

Every bit is 1 when it is safe to move, so that a silent or broken device reads as "stop".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntFlag
from typing import Final

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


class SafetyRequest(IntFlag):
    """Bits of 2501h."""

    STO = 0x01
    RESET = 0x02  # rising edge: acknowledges an STO whose cause is gone


# plain numbers: enum arithmetic is slow, and this is read several times per tick
DEAD_MAN: Final = (SafetyInput.DEAD_MAN_A | SafetyInput.DEAD_MAN_B).value
EMERGENCY_STOP: Final = (SafetyInput.EMERGENCY_STOP_A | SafetyInput.EMERGENCY_STOP_B).value
SCANNER_CLEAR: Final = SafetyInput.SCANNER_CLEAR.value
TORQUE_PERMITTED: Final = (SafetyInput.TORQUE_PERMITTED_A | SafetyInput.TORQUE_PERMITTED_B).value
ALL: Final = DEAD_MAN | EMERGENCY_STOP | SCANNER_CLEAR | TORQUE_PERMITTED


@dataclass(frozen=True, kw_only=True)
class SafetyPlc(Device):
    """A safety controller that reads the switches and drives the STO lines."""

    group: str = "safety"
    eds: str = "safety_plc.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Bits of `SafetyInput`."""
        return {(0x2500, 0): Word("inputs")}

    def outputs(self) -> Mapping[Address, Field]:
        """Bits of `SafetyRequest`."""
        return {(0x2501, 0): Word("request")}


class SafetySignals:
    """What the safety controllers of a group say together: safe only if all of them say so."""

    def __init__(self, image: ProcessImage, group: str = "safety") -> None:
        self._inputs: NDArray[np.uint32] = image.word(f"{group}.inputs")
        self._request: NDArray[np.uint32] = image.word(f"{group}.request")

    def state(self) -> tuple[bool, bool, bool, bool]:
        """`dead_man`, `emergency_stop`, `scanner_clear` and `sto`, read once."""
        bits = self._common()
        return (
            bits & DEAD_MAN == DEAD_MAN,
            bits & EMERGENCY_STOP != EMERGENCY_STOP,
            bits & SCANNER_CLEAR != 0,
            bits & TORQUE_PERMITTED != TORQUE_PERMITTED,
        )

    @property
    def inputs(self) -> SafetyInput:
        """The bits that are set on every controller."""
        return SafetyInput(self._common())

    @property
    def dead_man(self) -> bool:
        """Pressed on both channels."""
        return self._all(DEAD_MAN)

    @property
    def emergency_stop(self) -> bool:
        """Pressed: open on at least one channel."""
        return not self._all(EMERGENCY_STOP)

    @property
    def scanner_clear(self) -> bool:
        """Nobody in the scanned field."""
        return self._all(SCANNER_CLEAR)

    @property
    def sto(self) -> bool:
        """STO acts on at least one channel."""
        return not self._all(TORQUE_PERMITTED)

    @property
    def disagreement(self) -> bool:
        """The two channels of a signal differ; normal for some ticks while a switch moves."""
        pairs = (DEAD_MAN, EMERGENCY_STOP, TORQUE_PERMITTED)
        return any(0 < word & pair < pair for word in self._inputs.tolist() for pair in pairs)

    def request(self, bits: SafetyRequest) -> None:
        """Sets the request byte of all controllers of the group."""
        self._request[:] = int(bits)

    def _all(self, bits: int) -> bool:
        return self._common() & bits == bits

    def _common(self) -> int:
        common: int = ALL
        for word in self._inputs.tolist():
            common &= word
        return common
