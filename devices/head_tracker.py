"""A tracker of the operator's head."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .group import Group, Quantities, Words


class HeadTracker(Device, frozen=True, kw_only=True, tag="head_tracker"):
    """Reports where a head is, in axes of its own."""

    group: str = "head"
    eds: str = "head_tracker.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Pose (position, quaternion x y z w) and status."""
        return {**{(0x2600, i): Quantity("pose") for i in range(1, 8)}, (0x2612, 0): Word("status")}


class HeadTrackers(Group):
    """The trackers of a group.

    Attributes:
        pose: (n, 7) position and quaternion x y z w [m].
        status: (n,) bits of `force_torque.SensorStatus`.
    """

    kind = HeadTracker
    pose: Quantities
    status: Words
