"""Push buttons, pedals or switches, a bit each."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field, Word
from .group import Group, Words


class Buttons(Device, frozen=True, kw_only=True, tag="buttons"):
    """Reports which are pressed; no safety rests on it."""

    group: str = "buttons"
    eds: str = "buttons.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Which are pressed."""
        return {(0x2700, 0): Word("pressed")}


class ButtonRows(Group):
    """The devices of a group.

    Attributes:
        pressed: (n,) a bit each.
    """

    kind = Buttons
    pressed: Words
