"""What a person does with a simulated machine, at its side rather than over its bus.

A deed is a byte, and three numbers more where a hand is led to a place.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import Final


class Switch(Enum):
    """What a person holds or turns, by its name at the safety controller."""

    DEAD_MAN = "dead_man"
    SUPERVISOR = "supervisor"
    OVERRIDE = "override"
    EMERGENCY_STOP = "emergency_stop"


class Deed(Enum):
    """What the person does, as it travels to the plant."""

    PRESS = 1
    RELEASE = 2
    PUSH_LEFT = 3
    PUSH_RIGHT = 4
    PUSH_FORWARD = 5
    PUSH_BACK = 6
    PUSH_UP = 7
    PUSH_DOWN = 8
    SUPERVISE = 9
    LOOK_AWAY = 10
    OVERRIDE = 11
    ASK_FOR_A_HAND = 12
    ENTER_FIELD = 13
    LEAVE_FIELD = 14
    STRIKE = 15
    PULL_OUT = 16


DIRECTIONS: Final[Mapping[Deed, tuple[float, float, float]]] = {
    Deed.PUSH_LEFT: (-1.0, 0.0, 0.0),
    Deed.PUSH_RIGHT: (1.0, 0.0, 0.0),
    Deed.PUSH_FORWARD: (0.0, 1.0, 0.0),
    Deed.PUSH_BACK: (0.0, -1.0, 0.0),
    Deed.PUSH_UP: (0.0, 0.0, 1.0),
    Deed.PUSH_DOWN: (0.0, 0.0, -1.0),
}
"""In the world's axes, as on a map seen from above: x to the right, y forward."""


SWITCHES: Final[Mapping[Deed, tuple[Switch, bool]]] = {
    Deed.PRESS: (Switch.DEAD_MAN, True),
    Deed.RELEASE: (Switch.DEAD_MAN, False),
    Deed.SUPERVISE: (Switch.SUPERVISOR, True),
    Deed.LOOK_AWAY: (Switch.SUPERVISOR, False),
    Deed.OVERRIDE: (Switch.OVERRIDE, True),
    Deed.ASK_FOR_A_HAND: (Switch.OVERRIDE, False),
    Deed.STRIKE: (Switch.EMERGENCY_STOP, True),
    Deed.PULL_OUT: (Switch.EMERGENCY_STOP, False),
}


_LEAD: Final = struct.Struct("<B3f")
_LEAD_TAG: Final = 0x80


@dataclass(frozen=True, slots=True)
class Lead:
    """The hand wants to be at a place in the world from now on, (3,) [m]."""

    place: tuple[float, float, float]

    def encode(self) -> bytes:
        """As it travels to the plant."""
        return _LEAD.pack(_LEAD_TAG, *self.place)


class Hearing:
    """Finds deeds in what arrives at the plant, in pieces of any size; bytes that are none are skipped."""

    def __init__(self) -> None:
        self._rest = b""

    def take(self, data: bytes) -> list[Deed | Lead]:
        """What is complete, in order."""
        data, self._rest = self._rest + data, b""
        found: list[Deed | Lead] = []
        at = 0
        while at < len(data):
            if data[at] != _LEAD_TAG:
                if data[at] in _DEEDS:
                    found.append(_DEEDS[data[at]])
                at += 1
            elif len(data) - at < _LEAD.size:
                self._rest = data[at:]
                break
            else:
                _, x, y, z = _LEAD.unpack_from(data, at)
                if isfinite(x) and isfinite(y) and isfinite(z):
                    found.append(Lead((x, y, z)))
                at += _LEAD.size
        return found


_DEEDS: Final = {deed.value: deed for deed in Deed}
