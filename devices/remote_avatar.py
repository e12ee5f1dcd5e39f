"""An avatar's arm on the operator's bus: the gateway that hears from it and speaks to it."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .group import Group, Quantities, Words
from .remote import AGE_STEP, MOST_JOINTS


class RemoteAvatar(Device, frozen=True, kw_only=True, tag="remote_avatar"):
    """Reports what the avatar's palm feels and where its joints are; takes where the palm is to be.

    Poses, twists and wrenches are at the palm, in the axes of the stations' common base.
    """

    group: str = "remote"
    eds: str = "remote_avatar.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Wrench, joints, flags, age and energy of the peer."""
        return {
            **{(0x2602, i): Quantity("wrench") for i in range(1, 7)},
            **{(0x2603, i): Quantity("joints") for i in range(1, MOST_JOINTS + 1)},
            (0x2610, 0): Word("flags"),
            (0x2611, 0): Quantity("age", AGE_STEP),
            (0x2612, 0): Quantity("energy"),
        }

    def outputs(self) -> Mapping[Address, Field]:
        """Pose (position, quaternion x y z w), twist, flags and energy of this side."""
        return {
            **{(0x2600, i): Quantity("pose") for i in range(1, 8)},
            **{(0x2601, i): Quantity("twist") for i in range(1, 7)},
            (0x2620, 0): Word("own_flags"),
            (0x2622, 0): Quantity("own_energy"),
        }


class RemoteAvatars(Group):
    """The gateways of a group, one row an arm.

    Attributes:
        wrench: (n, 6) of the surroundings on the palm [N, N m].
        joints: (n, 7) of the avatar's arm, 0 beyond those that it has [rad].
        flags: (n,) see `remote.unpacked`; age: (n,) [s]; energy: (n,) [J].
        own_flags: (n,) to send.
    """

    kind = RemoteAvatar
    wrench: Quantities
    joints: Quantities
    flags: Words
    age: Quantities
    energy: Quantities
    own_flags: Words
