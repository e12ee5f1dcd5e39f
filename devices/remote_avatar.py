"""An avatar's arm on the operator's bus: the gateway that hears from it and speaks to it."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field
from .group import Group, Quantities, Words
from .remote import AVATAR_SAYS, HEARD, OPERATOR_SAYS, OWN


class RemoteAvatar(Device, frozen=True, kw_only=True, tag="remote_avatar"):
    """Reports what the avatar's palm feels and where its joints are; takes where the palm is to be.

    Poses, twists and wrenches are at the palm, in the axes of the stations' common base.
    """

    group: str = "remote"
    eds: str = "remote_avatar.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """What the peer says, and how it stands with it."""
        return {**AVATAR_SAYS, **HEARD}

    def outputs(self) -> Mapping[Address, Field]:
        """What this side says."""
        return {**OPERATOR_SAYS, **OWN}


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
