"""A paddle under a foot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .group import Group, Quantities, Words

SHARE: Final = 1e-4
"""Of a count, of the way of an axis."""


class FootPaddle(Device, frozen=True, kw_only=True, tag="foot_paddle"):
    """Reports three axes, -1 to 1 of their way: forward, to the left, about the upright axis."""

    group: str = "paddle"
    eds: str = "foot_paddle.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Axes and status."""
        return {**{(0x2600, i): Quantity("axes", SHARE) for i in range(1, 4)}, (0x2612, 0): Word("status")}


class FootPaddles(Group):
    """The paddles of a group.

    Attributes:
        axes: (n, 3) shares of their way.
        status: (n,) bits of `force_torque.SensorStatus`.
    """

    kind = FootPaddle
    axes: Quantities
    status: Words
