"""The link's end of a simulated machine whose twin leads an avatar's arm."""

from __future__ import annotations

from ...sim.gateway import Exchange, SimGateway
from ...sim.nodes import SimNodes
from .sections import Leads
from .wire import arms_alike, open_wire


class LeadingEnd:
    """A part of its plant.

    Attributes:
        link: with the avatar's gateways; nobody is there until it has a port.
    """

    def __init__(self, leads: Leads, nodes: SimNodes) -> None:
        self.link = Exchange(nodes.of(SimGateway))
        self._leads = leads

    def connect(self) -> None:
        """Open the link, if the configuration says where it is."""
        if self._leads.link.address is not None:
            self.link.port = open_wire(True, self._leads.link, self.link.sizes, self.identity())

    def identity(self) -> dict[str, str]:
        """What must be the same at the avatar, by name."""
        return {"arms": arms_alike(self._leads.left, self._leads.right)}
