"""All simulated devices of a network: what the plant has instead of a bus full of hardware."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, TypeVar

from ..configs import plugins
from ..devices.cia301 import NMT, SDO_REQUEST, NmtState
from ..devices.device import Device
from ..devices.errors import NetworkError
from ..devices.frames import Frames
from ..devices.network import Network
from ._plant import lib
from .node import SimNode
from .peers import Peers
from .safety_plc import SimSafetyPlc

Kind = Callable[[Any, Peers, int], SimNode]
N = TypeVar("N", bound=SimNode)

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
        self._peers = Peers(network)
        self._core = self._peers.core
        self.nodes = tuple(
            (own.get(type(device)) or simulation(device))(device, self._peers, i)
            for i, device in enumerate(network.devices)
        )
        self._by_name = {node.device.name: node for node in self.nodes}
        self._by_node = {node.device.node: node for node in self.nodes}
        controllers = self.of(SimSafetyPlc)
        self._core.safety = controllers[0].index if controllers else -1

    def __getitem__(self, name: str) -> SimNode:
        """The device of that name."""
        return self._by_name[name]

    def of(self, kind: type[N]) -> list[N]:
        """All devices of a kind, in the order of the network."""
        return [node for node in self.nodes if isinstance(node, kind)]

    def receive(self, frames_in: Frames, frames_out: Frames) -> None:
        """Takes a batch of frames and appends what the devices have to say, as far as there is room."""
        first = 0
        while (at := lib.peers_take(self._core, frames_in.pointer, first)) >= 0:
            self._serve(*frames_in[at])
            first = at + 1
        while (sender := lib.peers_give(self._core, frames_out.pointer)) >= 0:
            self._give(self.nodes[sender], frames_out)

    def advance(self, dt: float) -> None:
        """Lets plant time pass; what the devices send meanwhile goes out with the next `receive`.

        Args:
            dt: [s].
        """
        lib.peers_advance(self._core, round(dt * _NANOSECONDS))

    def _serve(self, can_id: int, data: bytes) -> None:
        """A frame that is not of the cycle: NMT or SDO."""
        if can_id == NMT:
            if len(data) == 2:
                self._command(*data)
            return
        node = self._by_node.get(can_id - SDO_REQUEST)
        if node and node.nmt_state is not NmtState.STOPPED:  # which knows NMT and heartbeat only
            node.objects.request(data)

    def _command(self, command: int, target: int) -> None:
        for node in self.nodes:
            if target in (0, node.device.node):
                node.command(command)

    def _give(self, node: SimNode, frames_out: Frames) -> None:
        """The next frame goes out as a fault makes of it; what there is no room for is lost."""
        frame = self._peers.outbox[self._core.given]
        self._core.given += 1
        assert node.tamper is not None
        for can_id, data in node.tamper(*frame):
            if len(frames_out) < frames_out.pointer.capacity:
                frames_out.append(can_id, data)
