"""A hand of the avatar on the operator's bus: the gateway that tells it what a glove measures."""

from __future__ import annotations

from collections.abc import Mapping

from .cia301 import Address
from .device import Device, Field
from .group import Group, Quantities, Words
from .remote import GLOVE_SAYS, HAND_SAYS, HEARD_FLAGS, OWN_FLAGS


class RemoteHand(Device, frozen=True, kw_only=True, tag="remote_hand"):
    """Reports what currents a hand's motors take; takes what the joints of a glove measure."""

    group: str = "remote_hands"
    eds: str = "remote_hand.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """What the peer says, and how old it is."""
        return {**HAND_SAYS, **HEARD_FLAGS}

    def outputs(self) -> Mapping[Address, Field]:
        """What this side says."""
        return {**GLOVE_SAYS, **OWN_FLAGS}


class RemoteHands(Group):
    """The gateways of a group, one row a hand.

    Attributes:
        current: (n, 9) of its motors, 0 beyond those that it has [A].
        flags: (n,) see `remote.unpacked`; age: (n,) [s].
        own_flags: (n,) to send.
    """

    kind = RemoteHand
    current: Quantities
    flags: Words
    age: Quantities
    own_flags: Words
