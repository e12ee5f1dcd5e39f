"""A simulated safety controller: two-channel switches, and the STO line to the drives."""

from __future__ import annotations

from ..devices.device import Device
from ._plant import lib
from .attributes import Stored
from .node import SimNode
from .peers import Peers


class SimSafetyPlc(SimNode):
    """STO acts at once on an open emergency stop or on request, and stays until it is acknowledged.

    Attributes:
        dead_man: pressed, per channel.
        emergency_stop: pressed (open), per channel.
        scanner_clear: nobody in the scanned field.
        latched: STO acts until it is acknowledged.
        deaf: it is asked in vain; set it to inject that.
        inputs: bits of `SafetyInput`, as reported last.
        request: bits of `SafetyRequest`, as received.
    """

    kind = lib.PEER_SAFETY
    says = ("inputs",)

    scanner_clear = Stored(bool, "safety")
    latched = Stored(bool, "safety")
    deaf = Stored(bool, "safety")
    inputs: int
    request: int

    def __init__(self, device: Device, peers: Peers, index: int) -> None:
        super().__init__(device, peers, index)
        self._core.told = self._place("request")
        self.scanner_clear = True

    def reset(self) -> None:
        """Power-up, or NMT reset, which does not acknowledge an STO."""
        self.request = self._core.safety.obeyed = 0
        super().reset()

    @property
    def sto(self) -> bool:
        """Whether STO acts on the drives."""
        return bool(lib.peers_safety_sto(self._peers.core, self.index))

    @property
    def dead_man(self) -> tuple[bool, bool]:
        """See above."""
        first, second = self._core.safety.dead_man
        return bool(first), bool(second)

    @dead_man.setter
    def dead_man(self, pressed: tuple[bool, bool]) -> None:
        self._core.safety.dead_man = pressed

    @property
    def emergency_stop(self) -> tuple[bool, bool]:
        """See above."""
        first, second = self._core.safety.emergency_stop
        return bool(first), bool(second)

    @emergency_stop.setter
    def emergency_stop(self, pressed: tuple[bool, bool]) -> None:
        self._core.safety.emergency_stop = pressed
