"""Simulated gateways: what the devices of a station say to those of the other one, and hear from them."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import cache
from math import isfinite
from typing import ClassVar, Final

import numpy as np

from ..devices.cia301 import AlState
from ..devices.remote import AGE_STEP, MOST_DRIVES, UNHEARD
from ..devices.sense_glove import GLOVE_JOINTS
from ..link.port import Port
from .node import SimNode

NEVER: Final = AGE_STEP * UNHEARD
"""Age of what was never heard [s]."""
OPERATOR_SAYS: Final = np.dtype(
    [("pose", "<f4", 7), ("twist", "<f4", 6), ("flags", "<u2"), ("energy", "<f4")], align=False
)
AVATAR_SAYS: Final = np.dtype(
    [("wrench", "<f4", 6), ("joints", "<f4", 7), ("flags", "<u2"), ("energy", "<f4")], align=False
)
GLOVE_SAYS: Final = np.dtype([("angle", "<f4", len(GLOVE_JOINTS)), ("flags", "<u2")], align=False)
HAND_SAYS: Final = np.dtype([("current", "<f4", MOST_DRIVES), ("flags", "<u2")], align=False)
PILOT_SAYS: Final = np.dtype([("head", "<f4", 7), ("paddle", "<f4", 3), ("flags", "<u2")], align=False)
BODY_SAYS: Final = np.dtype([("way", "<f4", 6), ("speed", "<f4", 3), ("flags", "<u2")], align=False)
"""What a station sends of each arm and hand, and of head and foot; a packet holds them side by side."""
OWN: Final = {"flags": "own_flags", "energy": "own_energy"}
"""Fields of both directions, as a gateway calls those that go out."""


class SimGateway(SimNode):
    """Gateway of an arm or a hand: what it is told goes to the gateway at the other side, which reports it.

    Attributes:
        age: of what it reports [s].
    """

    says_to_peer: ClassVar[np.dtype[np.void]]
    hears_of_peer: ClassVar[np.dtype[np.void]]
    age: float = NEVER

    @property
    def operating(self) -> bool:
        """Whether what it is told is valid: without its daemon it has nothing to say."""
        return self.al_state is AlState.OP

    def say(self) -> bytes:
        """What goes out."""
        packer, places = _layout(self.says_to_peer)
        values = [x for name in places for x in self.fields[OWN.get(name, name)].tolist()]
        return packer.pack(*values)

    def hear(self, payload: bytes) -> bool:
        """Report what came in, of the right length; nothing of it, and False, if a number is not finite."""
        packer, places = _layout(self.hears_of_peer)
        values = packer.unpack(payload)
        if not all(map(isfinite, values)):
            return False
        for name, place in places.items():
            self.fields[name][:] = values[place]
        return True


@cache
def _layout(said: np.dtype[np.void]) -> tuple[struct.Struct, dict[str, slice]]:
    """How a packet of one arm is packed, and which of its values belong to which field."""
    code, places, at = "<", {}, 0
    for name in said.names or ():
        field = said[name]
        count = int(np.prod(field.shape, dtype=int))
        code += f"{count}{field.base.char}"
        places[name] = slice(at, at := at + count)
    return struct.Struct(code), places


class Exchange:
    """Carries what the gateways of a station say and hear, all of them in one packet.

    Attributes:
        port: to the other station; None: nobody is there.
        sizes: bytes of a packet that goes out, and of one that comes in.
        dropped: packets that were no packet of these gateways.
    """

    def __init__(self, gateways: Sequence[SimGateway]) -> None:
        self._gateways = gateways
        self.sizes = (
            sum(gateway.says_to_peer.itemsize for gateway in gateways),
            sum(gateway.hears_of_peer.itemsize for gateway in gateways),
        )
        self.port: Port | None = None
        self.dropped = 0
        self._age = NEVER

    def step(self, dt: float) -> None:
        """A period of dt [s] has passed: send the newest state, and report the newest that came."""
        self._age = min(NEVER, self._age + dt)
        port = self.port
        if port is not None:
            if all(gateway.operating for gateway in self._gateways):
                port.send(b"".join(gateway.say() for gateway in self._gateways))
            received = port.receive()
            if received is not None and self._take(received.payload):
                self._age = min(NEVER, received.age)
        for gateway in self._gateways:
            gateway.age = self._age

    def _take(self, payload: bytes) -> bool:
        if len(payload) != self.sizes[1]:
            self.dropped += 1
            return False
        at, good = 0, True
        for gateway in self._gateways:
            size = gateway.hears_of_peer.itemsize
            good &= gateway.hear(payload[at : at + size])
            at += size
        self.dropped += not good
        return good
