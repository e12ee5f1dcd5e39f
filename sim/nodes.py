"""All simulated devices of a network: what the plant has instead of a bus full of hardware."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeVar

from ..configs import plugins
from ..devices.cia301 import (
    MAX_NODE,
    MAX_OUTPUT_FRAME,
    NMT,
    OUTPUT,
    SDO_REQUEST,
    SYNC,
    NmtState,
)
from ..devices.device import Device
from ..devices.errors import NetworkError
from ..devices.frames import CAPACITY, Frames
from ..devices.network import HEADER, Network
from .drive import SimDrive
from .node import SimNode
from .safety_plc import SimSafetyPlc

Kind = Callable[[Any, deque[tuple[int, bytes]]], SimNode]
N = TypeVar("N", bound=SimNode)

_HEADER: Final = struct.Struct("<HB")
_VALID: Final = 0x01
_NANOSECONDS: Final = 1e9


def simulation(device: Device) -> Kind:
    """What simulates a device: what its own package, or another that is installed, names for its kind.

    Raises:
        NetworkError: nothing does.
        PluginError: what does cannot be loaded.
    """
    tag = str(type(device).__struct_config__.tag)
    try:
        found: Kind = plugins.plugin(plugins.SIMULATED_DEVICES, tag)
    except KeyError:
        problem = f"nothing simulates the type '{tag}'; name it under [{plugins.SIMULATED_DEVICES}]"
        raise NetworkError(device.name, problem) from None
    return found


class SimNodes:
    """The devices of a network, powered up; the first safety controller holds the drives' STO line.

    Attributes:
        nodes: in the order of the network.
    """

    def __init__(self, network: Network, kinds: Mapping[type[Device], Kind] | None = None) -> None:
        """Powers the devices up.

        Args:
            network: the devices.
            kinds: what simulates devices whose kind is not installed, or is to be simulated otherwise.
        """
        own = kinds or {}
        self._outbox: deque[tuple[int, bytes]] = deque(maxlen=CAPACITY)
        self.nodes = tuple(
            (own.get(type(device)) or simulation(device))(device, self._outbox) for device in network.devices
        )
        self._by_name = {node.device.name: node for node in self.nodes}
        self._by_node = {node.device.node: node for node in self.nodes}
        self._frames: dict[int, bytes] = {}
        controllers = self.of(SimSafetyPlc)
        for drive in self.of(SimDrive):
            drive.sto_line = controllers[0] if controllers else None

    def __getitem__(self, name: str) -> SimNode:
        """The device of that name."""
        return self._by_name[name]

    def of(self, kind: type[N]) -> list[N]:
        """All devices of a kind, in the order of the network."""
        return [node for node in self.nodes if isinstance(node, kind)]

    def receive(self, frames_in: Frames, frames_out: Frames) -> None:
        """Takes a batch of frames and appends what the devices have to say, as far as there is room."""
        for can_id, data in frames_in:
            if can_id == SYNC:
                self._sync(data)
            elif OUTPUT < can_id <= OUTPUT + MAX_OUTPUT_FRAME:
                self._frames[can_id - OUTPUT] = data
            elif can_id == NMT and len(data) == 2:
                self._command(*data)
            elif SDO_REQUEST < can_id <= SDO_REQUEST + MAX_NODE:
                node = self._by_node.get(can_id - SDO_REQUEST)
                if node and node.nmt_state is not NmtState.STOPPED:  # which knows NMT and heartbeat only
                    node.objects.request(data)
        while self._outbox and len(frames_out) < frames_out.pointer.capacity:
            frames_out.append(*self._outbox.popleft())

    def advance(self, dt: float) -> None:
        """Lets plant time pass; what the devices send meanwhile goes out with the next `receive`.

        Args:
            dt: [s].
        """
        nanoseconds = round(dt * _NANOSECONDS)
        for node in self.nodes:
            node.advance(nanoseconds)

    def _sync(self, data: bytes) -> None:
        if len(data) < HEADER:
            return
        counter, flags = _HEADER.unpack_from(data)
        self._frames[0] = data
        stamp = data[:2]
        frames = {number: payload for number, payload in self._frames.items() if payload[:2] == stamp}
        for node in self.nodes:
            node.sync(counter, bool(flags & _VALID), frames)
        self._frames.clear()

    def _command(self, command: int, target: int) -> None:
        for node in self.nodes:
            if target in (0, node.device.node):
                node.command(command)
