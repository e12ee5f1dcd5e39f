"""The simulated devices of a network in the C core: their state, what they report and what they were told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..binding import bind
from ..devices.device import Quantity, Word
from ..devices.dictionary import WIRE_TYPES
from ..devices.errors import NetworkError
from ..devices.frames import CAPACITY, Frames
from ..devices.network import Network, Place
from ._plant import ffi, lib


class Peers:
    """What `csrc/peer.h` works on; its arrays have the layout of the master's process image.

    Attributes:
        core: the C struct.
        network: the devices.
        outbox: what they sent and is not out yet.
    """

    def __init__(self, network: Network) -> None:
        self.network = network
        self.outbox = Frames(CAPACITY)
        self._values = {
            (kind, output): network.blank(kind, output=output)
            for kind in (Quantity, Word)
            for output in (False, True)
        }
        inputs = [place for place in network.inputs if place.field]
        table = ffi.new("peer[]", len(network.devices))
        self.core = ffi.new("peers *", {"count": len(table), "safety": -1, "outbox": self.outbox.pointer})
        bind(
            lib,
            self.core,
            peers=table,
            input=ffi.new("peer_entry[]", [self._entry(place, output=False) for place in inputs]),
            output=ffi.new("peer_entry[]", [self._entry(place, output=True) for place in network.outputs]),
            values=self._values[Quantity, False],
            words=self._values[Word, False],
            output_values=self._values[Quantity, True],
            output_words=self._values[Word, True],
            sender=np.zeros(CAPACITY, np.uint8),
        )
        for i, device in enumerate(network.devices):
            peer, slot = table[i], network.slots[i]
            peer.node, peer.tpdo_length = device.node, network.tpdo_length[i]
            peer.input, peer.inputs = _span(i, inputs)
            peer.output, peer.outputs = _span(i, network.outputs)
            peer.slot_size = slot.size if slot else 0
            peer.says = [-1] * len(peer.says)

    def fields(self, i: int) -> dict[str, NDArray[Any]]:
        """The fields of a device, (components,) each; views."""
        found = {}
        for place in self._places(i):
            assert place.field is not None
            if place.component == 0:
                start, width = self.network.target(place), self.network.range_of(place).width
                found[place.field.field] = self._all(place)[start : start + width]
        return found

    def place(self, i: int, name: str) -> int:
        """Where a field of a device begins among all of its kind and direction, -1 where it has none."""
        places = (place for place in self._places(i) if place.field and place.field.field == name)
        return next(map(self.network.target, places), -1)

    def column(self, devices: Sequence[int], name: str) -> NDArray[Any]:
        """A number of each of some devices that follow each other in a group: the field of that name; a view.

        Raises:
            NetworkError: they do not.
        """
        start, members = self.place(devices[0], name), [self.network.devices[i] for i in devices]
        if [self.place(i, name) for i in devices] != list(range(start, start + len(devices))):
            names = ", ".join(device.name for device in members)
            raise NetworkError(
                members[0].name, f"{name!r} of {names} do not lie side by side; make them one group"
            )
        place = next(p for p in self._places(devices[0]) if p.field and p.field.field == name)
        return self._all(place)[start : start + len(devices)]

    def _places(self, i: int) -> list[Place]:
        network = self.network
        return [p for p in (*network.inputs, *network.outputs) if p.device == i and p.field]

    def _all(self, place: Place) -> NDArray[Any]:
        field = self.network.range_of(place)
        return self._values[field.kind, field.output]

    def _entry(self, place: Place, *, output: bool) -> dict[str, Any]:
        """A row of the C tables."""
        field = place.field
        scale, shift = (field.scale, field.shift) if isinstance(field, Quantity) else (1.0, 0.0)
        return {
            "gain": scale if output else 1.0 / scale,
            "shift": shift,
            "target": self.network.target(place),
            "offset": place.mapped.offset,
            "type": WIRE_TYPES[place.mapped.data_type][0],
            "word": isinstance(field, Word),
        }


def _span(i: int, places: Any) -> tuple[int, int]:
    """First of the entries of a device, and how many there are."""
    own = [k for k, place in enumerate(places) if place.device == i]
    return (own[0] if own else 0), len(own)
