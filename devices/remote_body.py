"""Neck and base of the avatar on the operator's bus: the gateway that speaks to them."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field
from .group import Group, Quantities, Words
from .remote import BODY_SAYS, HEARD_FLAGS, OWN_FLAGS, PILOT_SAYS


class RemoteBody(Device, frozen=True, kw_only=True, tag="remote_body"):
    """Reports what neck and base of the avatar do; takes where the operator's head and foot are."""

    group: str = "body"
    eds: str = "remote_body.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """What the peer says, and how old it is."""
        return {**BODY_SAYS, **HEARD_FLAGS}

    def outputs(self) -> Mapping[Address, Field]:
        """What this side says."""
        return {**PILOT_SAYS, **OWN_FLAGS}


class RemoteBodies(Group):
    """The gateways of a group.

    Attributes:
        way: (n, 6) of the avatar's head from its middle [m, rad]; speed: (n, 3) of its base [m/s, rad/s].
        flags: (n,) see `remote.unpacked`; age: (n,) [s].
        own_flags: (n,) to send.
    """

    kind = RemoteBody
    way: Quantities
    speed: Quantities
    flags: Words
    age: Quantities
    own_flags: Words
