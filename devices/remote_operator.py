"""An operator's arm on the avatar's bus: the gateway that hears from it and speaks to it."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field
from .group import Group, Quantities, Words
from .remote import AVATAR_SAYS, HEARD, OPERATOR_SAYS, OWN


class RemoteOperator(Device, frozen=True, kw_only=True, tag="remote_operator"):
    """Reports where the operator's palm is to be; takes what the avatar's palm feels.

    Poses, twists and wrenches are at the palm, in the axes of the stations' common base.
    """

    group: str = "remote"
    eds: str = "remote_operator.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """What the peer says, and how it stands with it."""
        return {**OPERATOR_SAYS, **HEARD}

    def outputs(self) -> Mapping[Address, Field]:
        """What this side says."""
        return {**AVATAR_SAYS, **OWN}


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
