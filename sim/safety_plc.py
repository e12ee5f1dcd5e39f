"""A simulated safety controller: two-channel switches, and the STO line to the drives."""

from __future__ import annotations

from ..devices.device import Device
from ._plant import lib
from .attributes import Stored, TwoChannels
from .node import SimNode
from .peers import Peers
from .person import Switch


class SimSafetyPlc(SimNode):
    """STO acts at once on an open emergency stop or on request, and stays until it is acknowledged.

    Attributes:
        dead_man: pressed, per channel.
        supervisor: the safety operator's dead-man switch is pressed, per channel.
        override: the key for motion without a hand is turned, per channel.
        emergency_stop: pressed (open), per channel.
        scanner_clear: nobody in the scanned field.
        latched: STO acts until it is acknowledged.
        deaf: it is asked in vain; set it to inject that.
        inputs: bits of `SafetyInput`, as reported last.
        request: bits of `SafetyRequest`, as received.
    """

    kind = lib.PEER_SAFETY
    says = ("inputs",)

    dead_man = TwoChannels("safety")
    supervisor = TwoChannels("safety")
    override = TwoChannels("safety")
    emergency_stop = TwoChannels("safety")
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

    def turn(self, switch: Switch, pressed: bool) -> None:
        """Both channels of a switch."""
        setattr(self, switch.value, (pressed, pressed))
