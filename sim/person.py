"""What a person does with a simulated machine, at its side rather than over its bus: one byte a deed."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final


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


DIRECTIONS: Final[Mapping[Deed, tuple[float, float, float]]] = {
    Deed.PUSH_LEFT: (-1.0, 0.0, 0.0),
    Deed.PUSH_RIGHT: (1.0, 0.0, 0.0),
    Deed.PUSH_FORWARD: (0.0, 1.0, 0.0),
    Deed.PUSH_BACK: (0.0, -1.0, 0.0),
    Deed.PUSH_UP: (0.0, 0.0, 1.0),
    Deed.PUSH_DOWN: (0.0, 0.0, -1.0),
}
"""In the world's axes, as on a map seen from above: x to the right, y forward."""


def deeds(data: bytes) -> list[Deed]:
    """What arrived at the plant, in order; bytes that are no deed are skipped."""
    return [_DEEDS[byte] for byte in data if byte in _DEEDS]


_DEEDS: Final = {deed.value: deed for deed in Deed}
