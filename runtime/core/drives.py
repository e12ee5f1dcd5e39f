"""Who has torque: drives walk to where the mode wants them, or the safety PLC takes it from them."""

from __future__ import annotations

from ...devices.cia402 import PowerStage, State
from ...devices.errors import DeviceError
from ...devices.image import ProcessImage
from ...devices.safety_plc import SafetyRequest, SafetySignals
from ...safety import PASS, Reaction, Verdict
from .events import EventKind
from .machine import Machine
from .modes import UNPREPARED, Mode
from .phase import Phase

TRANSITION_DEADLINE_S = 0.2
"""Each transition of a drive's CiA 402 state machine."""
NO_REQUEST = SafetyRequest(0)


class Drives:
    """Takes the drives to what the mode needs.

    Attributes:
        power: their power stages.
    """

    def __init__(self, image: ProcessImage, machine: Machine, phase: Phase, rate: float) -> None:
        groups = [group for group, _ in machine.outputs]
        self.power = PowerStage(image, groups, round(TRANSITION_DEADLINE_S * rate))
        self._phase = phase

    @property
    def secured(self) -> bool:
        """Whether no drive has power: none was ever switched on, or every one says now that it is off."""
        mode = self._phase.mode
        return mode in UNPREPARED or not (mode.powered or self.power.live)

    def enable(self) -> None:
        """Switch on."""
        self.power.request(State.OPERATION_ENABLED)

    def disable(self) -> None:
        """Switch off, unless that is under way."""
        if self.power.target is not State.SWITCH_ON_DISABLED:
            self.power.request(State.SWITCH_ON_DISABLED)

    def walk(self) -> Verdict:
        """One step towards what the mode needs."""
        power, phase = self.power, self._phase
        if not phase.mode.powered:
            self.disable()
        try:
            ready = power.step()
        except DeviceError as error:
            # whoever does not switch off, or does not say so, loses its torque by the safety PLC
            disobeys = power.target is State.SWITCH_ON_DISABLED and power.live
            reaction = Reaction.OFF if disobeys else Reaction.RAMP
            return Verdict(reaction, "drive_state", str(error))
        if phase.mode is Mode.ENABLING and ready:
            phase.enter(Mode.ENGAGING, EventKind.ENGAGING())
        return PASS


class TorqueOff:
    """Asks the safety PLC to take the torque off (STO), and to let go again."""

    def __init__(self, signals: SafetySignals, phase: Phase, rate: float) -> None:
        self._signals, self._phase = signals, phase
        self._limit = round(TRANSITION_DEADLINE_S * rate)
        self._asked = NO_REQUEST
        self._unconfirmed = 0

    def ask(self, off: bool, acknowledging: bool, confirmed: bool) -> None:
        """What stands at this tick.

        Args:
            off: whether the torque must be off.
            acknowledging: whether the PLC is to let go, which counts more.
            confirmed: whether it says that the torque is off.
        """
        wanted = NO_REQUEST
        if acknowledging:
            wanted = SafetyRequest.RESET
        elif off:
            wanted = SafetyRequest.STO
            self._unconfirmed = 0 if confirmed else self._unconfirmed + 1
            if self._unconfirmed == self._limit:
                self._phase.say(EventKind.STO_UNCONFIRMED())
        if wanted is not self._asked:
            self._asked = wanted
            self._signals.request(wanted)
