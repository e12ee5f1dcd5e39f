"""The operator's head and foot on the avatar's bus: the gateway that hears of them."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field
from .group import Group, Quantities, Words
from .remote import BODY_SAYS, HEARD_FLAGS, OWN_FLAGS, PILOT_SAYS


class RemotePilot(Device, frozen=True, kw_only=True, tag="remote_pilot"):
    """Reports where the operator's head and foot are; takes what neck and base of the avatar do."""

    group: str = "pilot"
    eds: str = "remote_pilot.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """What the peer says, and how old it is."""
        return {**PILOT_SAYS, **HEARD_FLAGS}

    def outputs(self) -> Mapping[Address, Field]:
        """What this side says."""
        return {**BODY_SAYS, **OWN_FLAGS}


class RemotePilots(Group):
    """The gateways of a group.

    Attributes:
        head: (n, 7) position and quaternion [m]; paddle: (n, 3) shares of its way.
        flags: (n,) see `remote.unpacked`; age: (n,) [s].
        own_flags: (n,) to send.
    """

    kind = RemotePilot
    head: Quantities
    paddle: Quantities
    flags: Words
    age: Quantities
    own_flags: Words
