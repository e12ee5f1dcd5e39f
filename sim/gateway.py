"""Simulated gateways: what the devices of a station say to those of the other one, and hear from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np

from ..binding import bind
from ..devices.remote import AGE_STEP, MOST_DRIVES, UNHEARD
from ..devices.sense_glove import GLOVE_JOINTS
from ..link.port import Port
from ._plant import ffi, lib
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


class Exchange:
    """Carries what the gateways of a station say and hear, all of them in one packet (`csrc/gateway.h`).

    Attributes:
        port: to the other station; None: nobody is there.
        sizes: bytes of a packet that goes out, and of one that comes in.
        dropped: packets that were no packet of these gateways.
    """

    def __init__(self, gateways: Sequence[SimGateway]) -> None:
        """At least one, all of one network.

        Raises:
            NetworkError: one of them has no field for something that is said.
        """
        say, out = _packet(gateways, [gateway.says_to_peer for gateway in gateways], OWN)
        hear, back = _packet(gateways, [gateway.hears_of_peer for gateway in gateways], {})
        self.sizes = (out, back)
        self.port: Port | None = None
        self.dropped = 0
        self._age = NEVER
        self._peers = gateways[0]._peers.core
        self._core = ffi.new("gateways *", {"count": len(gateways), "said": sum(map(len, say))})
        numbers = {
            "device": [gateway.index for gateway in gateways],
            "age": [gateway._place("age") for gateway in gateways],
            "hears": [len(own) for own in hear],
        }
        bind(
            lib,
            self._core,
            **{name: np.array(values, np.int32) for name, values in numbers.items()},
            say=ffi.new("peer_entry[]", [entry for own in say for entry in own]),
            hear=ffi.new("peer_entry[]", [entry for own in hear for entry in own]),
        )
        self._packet = ffi.new("uint8_t[]", out)
        self._written = ffi.buffer(self._packet)

    def step(self, dt: float) -> None:
        """A period of dt [s] has passed: send the newest state, and report the newest that came."""
        self._age = min(NEVER, self._age + dt)
        port = self.port
        if port is not None:
            if lib.gateways_say(self._core, self._peers, self._packet):
                port.send(bytes(self._written))
            received = port.receive()
            if received is not None and self._take(received.payload):
                self._age = min(NEVER, received.age)
        lib.gateways_age(self._core, self._peers, self._age)

    def _take(self, payload: bytes) -> bool:
        good = len(payload) == self.sizes[1] and bool(lib.gateways_hear(self._core, self._peers, payload))
        self.dropped += not good
        return good


def _packet(
    gateways: Sequence[SimGateway], said: Sequence[np.dtype[np.void]], called: Mapping[str, str]
) -> tuple[list[list[dict[str, Any]]], int]:
    """Where in a packet everything of each gateway is, as C has it, and the packet's bytes.

    Args:
        gateways: whose parts of a packet follow each other.
        said: fields of each part.
        called: which of them the gateway has under another name.
    """
    parts, at = [], 0
    for gateway, part in zip(gateways, said, strict=True):
        parts.append(
            [
                {
                    "target": gateway._place(called.get(name, name)) + k,
                    "offset": at + place + k * field.base.itemsize,
                    "type": lib.CODEC_F32 if field.base.kind == "f" else lib.CODEC_U16,
                    "word": field.base.kind == "u",
                }
                for name, (field, place, *_) in (part.fields or {}).items()
                for k in range(int(np.prod(field.shape, dtype=int)))
            ]
        )
        at += part.itemsize
    return parts, at
