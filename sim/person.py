"""What a person does with a simulated machine, at its side rather than over its bus: one byte a deed."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final


class Switch(Enum):
    """What a person holds or turns, by its name at the safety controller."""

    DEAD_MAN = "dead_man"
    SUPERVISOR = "supervisor"
    OVERRIDE = "override"


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
}


def deeds(data: bytes) -> list[Deed]:
    """What arrived at the plant, in order; bytes that are no deed are skipped."""
    return [_DEEDS[byte] for byte in data if byte in _DEEDS]


_DEEDS: Final = {deed.value: deed for deed in Deed}
