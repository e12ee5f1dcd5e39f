"""A simulated safety controller: two-channel switches, and the STO line to the drives."""

from __future__ import annotations

from collections import deque

from ..devices.cia301 import AlState
from ..devices.safety_plc import SCANNER_CLEAR, TORQUE_PERMITTED, SafetyInput, SafetyPlc, SafetyRequest
from .node import SimNode

# plain numbers: enum arithmetic is slow, and this runs several times per tick
_DEAD_MAN = (SafetyInput.DEAD_MAN_A.value, SafetyInput.DEAD_MAN_B.value)
_EMERGENCY_STOP = (SafetyInput.EMERGENCY_STOP_A.value, SafetyInput.EMERGENCY_STOP_B.value)
_REQUEST_STO = SafetyRequest.STO.value
_REQUEST_RESET = SafetyRequest.RESET.value


class SimSafetyPlc(SimNode):
    """STO acts at once on an open emergency stop or on request, and stays until it is acknowledged.

    Attributes:
        dead_man: pressed, per channel.
        emergency_stop: pressed (open), per channel.
        scanner_clear: nobody in the scanned field.
        request: bits of `SafetyRequest`, as received.
    """

    def __init__(self, device: SafetyPlc, outbox: deque[tuple[int, bytes]]) -> None:
        self.dead_man = (False, False)
        self.emergency_stop = (False, False)
        self.scanner_clear = True
        self._latched = False
        super().__init__(device, outbox)

    def reset(self) -> None:
        """Power-up, or NMT reset, which does not acknowledge an STO."""
        self.request = self._obeyed = 0
        super().reset()

    @property
    def sto(self) -> bool:
        """Whether STO acts on the drives."""
        return self._latched or self._cause

    @property
    def inputs(self) -> int:
        """Bits of `SafetyInput`."""
        bits = SCANNER_CLEAR if self.scanner_clear else 0
        for channel in (0, 1):
            if self.dead_man[channel]:
                bits |= _DEAD_MAN[channel]
            if not self.emergency_stop[channel]:
                bits |= _EMERGENCY_STOP[channel]
        return bits if self.sto else bits | TORQUE_PERMITTED

    def outputs_latched(self) -> None:
        """Obeys the request: an acknowledgement is a rising edge, and needs the cause gone."""
        edge = self.request & ~self._obeyed
        self._obeyed = self.request
        if edge & _REQUEST_RESET:
            self._latched = False
        self._latched = self.sto  # again, where the cause is still there

    def outputs_invalid(self) -> None:
        """Without valid outputs there is no request; what was latched stays."""
        self._latched = self.sto
        self.request = self._obeyed = 0

    def watchdog_tripped(self) -> None:
        """A silent master: STO."""
        self._latched = True
        self.request = self._obeyed = 0
        super().watchdog_tripped()

    def advance(self, dt: int) -> None:
        """Lets plant time pass; a cause that shows now is latched."""
        super().advance(dt)
        self._latched = self.sto

    @property
    def _cause(self) -> bool:
        return True in self.emergency_stop or bool(
            self.request & _REQUEST_STO and self.al_state is AlState.OP
        )
