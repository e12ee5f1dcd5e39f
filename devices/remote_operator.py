"""An operator's arm on the avatar's bus: the gateway that hears from it and speaks to it."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .group import Group, Quantities, Words
from .remote import AGE_STEP, MOST_JOINTS


class RemoteOperator(Device, frozen=True, kw_only=True, tag="remote_operator"):
    """Reports where the operator's palm is to be; takes what the avatar's palm feels.

    Poses, twists and wrenches are at the palm, in the axes of the stations' common base.
    """

    group: str = "remote"
    eds: str = "remote_operator.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Pose (position, quaternion x y z w), twist, flags, age and energy of the peer."""
        return {
            **{(0x2600, i): Quantity("pose") for i in range(1, 8)},
            **{(0x2601, i): Quantity("twist") for i in range(1, 7)},
            (0x2610, 0): Word("flags"),
            (0x2611, 0): Quantity("age", AGE_STEP),
            (0x2612, 0): Quantity("energy"),
        }

    def outputs(self) -> Mapping[Address, Field]:
        """Wrench, joints, flags and energy of this side."""
        return {
            **{(0x2602, i): Quantity("wrench") for i in range(1, 7)},
            **{(0x2603, i): Quantity("joints") for i in range(1, MOST_JOINTS + 1)},
            (0x2620, 0): Word("own_flags"),
            (0x2622, 0): Quantity("own_energy"),
        }


class RemoteOperators(Group):
    """The gateways of a group, one row an arm.

    Attributes:
        pose: (n, 7) position and quaternion of the palm [m].
        twist: (n, 6) [m/s, rad/s].
        flags: (n,) see `remote.unpacked`; age: (n,) [s]; energy: (n,) [J].
        own_flags: (n,) to send.
    """

    kind = RemoteOperator
    pose: Quantities
    twist: Quantities
    flags: Words
    age: Quantities
    energy: Quantities
    own_flags: Words
