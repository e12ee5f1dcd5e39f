"""What simulated drives share: the CiA 402 state machine as the drive sees it, brake, STO, faults."""

from __future__ import annotations

from collections import deque
from typing import Final, Protocol

from ..devices.cia301 import EMCY_RPDO_TIMEOUT, AlState
from ..devices.cia402 import MODE, STATUS, VOLTAGE_ENABLED, State
from ..devices.device import Device
from .node import SimNode

# What each command makes of each state, with the standard's transition numbers
_SHUTDOWN: Final = {
    State.SWITCH_ON_DISABLED: State.READY_TO_SWITCH_ON,  # 2
    State.SWITCHED_ON: State.READY_TO_SWITCH_ON,  # 6
    State.OPERATION_ENABLED: State.READY_TO_SWITCH_ON,  # 8
}
_SWITCH_ON: Final = {
    State.READY_TO_SWITCH_ON: State.SWITCHED_ON,  # 3
    State.OPERATION_ENABLED: State.SWITCHED_ON,  # 5
}
_ENABLE_OPERATION: Final = {
    State.READY_TO_SWITCH_ON: State.SWITCHED_ON,  # 3
    State.SWITCHED_ON: State.OPERATION_ENABLED,  # 4
    State.QUICK_STOP_ACTIVE: State.OPERATION_ENABLED,  # 16
}
_DISABLE_VOLTAGE: Final = {
    State.READY_TO_SWITCH_ON: State.SWITCH_ON_DISABLED,  # 7
    State.OPERATION_ENABLED: State.SWITCH_ON_DISABLED,  # 9
    State.SWITCHED_ON: State.SWITCH_ON_DISABLED,  # 10
    State.QUICK_STOP_ACTIVE: State.SWITCH_ON_DISABLED,  # 12
}
_QUICK_STOP: Final = {
    State.READY_TO_SWITCH_ON: State.SWITCH_ON_DISABLED,  # 7
    State.SWITCHED_ON: State.SWITCH_ON_DISABLED,  # 10
    State.OPERATION_ENABLED: State.QUICK_STOP_ACTIVE,  # 11
}
# Controlword: mask and value of each command
_COMMANDS: Final = (
    (0x8F, 0x0F, _ENABLE_OPERATION),
    (0x8F, 0x07, _SWITCH_ON),
    (0x87, 0x06, _SHUTDOWN),
    (0x86, 0x02, _QUICK_STOP),
    (0x82, 0x00, _DISABLE_VOLTAGE),
)
_FAULT_RESET: Final = 0x80
_ENABLE: Final = 0x0F
_ENABLED: Final = State.OPERATION_ENABLED
_OP: Final = AlState.OP
_REMOTE: Final = 0x0200  # a bit of the statusword that is always set here
_STATUSWORD: Final = {state: value | _REMOTE for state, (_, value) in STATUS.items()}
_ERROR_GENERIC: Final = 0x01


class StoLine(Protocol):
    """The wire that takes the torque away."""

    @property
    def sto(self) -> bool:
        """Whether STO acts."""


class SimDrive(SimNode):
    """A drive. It moves its axis only in OP, operation enabled, in its mode and without STO.

    Attributes:
        state: of CiA 402.
        fault: code of a fault whose cause is present (603Fh), 0 = none; set it to inject one.
        error_code: 603Fh, stays until the fault is reset.
        controlword: as received.
        mode: mode of operation (6060h and 6061h).
        position, velocity: what the encoder reports; the plant sets them.
        sto_line: whatever switches STO, or None.
    """

    own_mode: int
    position: float
    velocity: float

    def __init__(self, device: Device, outbox: deque[tuple[int, bytes]]) -> None:
        self.sto_line: StoLine | None = None
        self.fault = 0
        super().__init__(device, outbox)

    def reset(self) -> None:
        """Power-up: not ready to switch on."""
        self.state = State.NOT_READY_TO_SWITCH_ON
        self.controlword = self._obeyed = 0
        self.error_code = 0
        super().reset()

    @property
    def sto(self) -> bool:
        """Whether STO acts on this drive."""
        return self.sto_line is not None and self.sto_line.sto

    @property
    def powered(self) -> bool:
        """Whether it moves its axis; otherwise the brake is closed."""
        enabled = self.state is _ENABLED and self.al_state is _OP
        return enabled and self.mode == self.own_mode and not self.sto

    @property
    def brake(self) -> bool:
        """Whether the brake is closed."""
        return not self.powered

    @property
    def statusword(self) -> int:
        """6041h."""
        word = _STATUSWORD[self.state]
        return word if self.sto else word | VOLTAGE_ENABLED

    def outputs_latched(self) -> None:
        """Obeys the controlword."""
        controlword, before = self.controlword, self._obeyed
        self._obeyed = controlword
        if controlword == _ENABLE and self.state is _ENABLED:
            return
        if self.state is State.FAULT:
            if controlword & ~before & _FAULT_RESET and not self.fault:  # transition 15
                self.state = State.SWITCH_ON_DISABLED
                self.error_code = 0
                self.emergency(0, 0)
        elif not self.sto:
            for mask, value, transitions in _COMMANDS:
                if controlword & mask == value:
                    self.state = transitions.get(self.state, self.state)
                    return

    def outputs_invalid(self) -> None:
        """Without valid outputs the voltage goes off."""
        self._obeyed = 0
        self.state = _DISABLE_VOLTAGE.get(self.state, self.state)

    def watchdog_tripped(self) -> None:
        """A fault, to be reset by the master."""
        self._obeyed = 0
        if self.state is not State.FAULT:
            self._trip(EMCY_RPDO_TIMEOUT)

    def watchdog_acknowledged(self) -> None:
        """The fault stays until it is reset."""

    def advance(self, dt: int) -> None:
        """Lets plant time pass: watchdog, STO, faults and the automatic transitions."""
        super().advance(dt)
        if self.state is State.NOT_READY_TO_SWITCH_ON:  # transition 1
            self.state = State.SWITCH_ON_DISABLED
        elif self.state is State.FAULT_REACTION_ACTIVE:  # transition 14
            self.state = State.FAULT
        elif self.fault and self.state is not State.FAULT:
            self._trip(self.fault)
        elif self.sto:
            self.state = _DISABLE_VOLTAGE.get(self.state, self.state)

    def _trip(self, code: int) -> None:  # transition 13
        self.state = State.FAULT_REACTION_ACTIVE
        self.error_code = code
        self.emergency(code, _ERROR_GENERIC)

    def _configure(self) -> None:
        super()._configure()
        self.mode = int(self.objects.read(MODE))
