"""A glove of the operator on the avatar's bus: the gateway that tells it what a hand's motors take."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field
from .group import Group, Quantities, Words
from .remote import GLOVE_SAYS, HAND_SAYS, HEARD_FLAGS, OWN_FLAGS


class RemoteGlove(Device, frozen=True, kw_only=True, tag="remote_glove"):
    """Reports what the joints of a glove measure; takes what currents a hand's motors take."""

    group: str = "remote_gloves"
    eds: str = "remote_glove.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """What the peer says, and how old it is."""
        return {**GLOVE_SAYS, **HEARD_FLAGS}

    def outputs(self) -> Mapping[Address, Field]:
        """What this side says."""
        return {**HAND_SAYS, **OWN_FLAGS}


class RemoteGloves(Group):
    """The gateways of a group, one row a glove.

    Attributes:
        angle: (n, 20) in the order of `sense_glove.GLOVE_JOINTS` [rad].
        flags: (n,) see `remote.unpacked`; age: (n,) [s].
        own_flags: (n,) to send.
    """

    kind = RemoteGlove
    angle: Quantities
    flags: Words
    age: Quantities
    own_flags: Words
