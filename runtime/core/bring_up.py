"""The beginning of a session: devices come up, and a second master is heard."""

from __future__ import annotations

from ...devices.bringup import Bringup, BringupState, Deadlines
from ...devices.errors import DeviceError
from ...devices.frames import Frames
from ...devices.image import ProcessImage
from ...safety import PASS, Reaction, Verdict
from .events import EventKind
from .modes import Mode
from .phase import Phase
from .senses import Senses


class BringUp:
    """Devices are brought up until they answer, or it fails.

    Attributes:
        failure: why it failed, for people; "" where it did not.
    """

    def __init__(self, image: ProcessImage, phase: Phase, senses: Senses, rate: float) -> None:
        self._phase, self._senses = phase, senses
        self._devices = Bringup(image, Deadlines.at(rate))
        self._intruders = 0
        self.failure = ""

    def step(self, tick: int, received: Frames, to_send: Frames) -> bool:
        """One tick of it; whether all devices have come up."""
        self._intruders += self._senses.listen(tick)
        try:
            return self._devices.step(received, to_send) is BringupState.READY
        except DeviceError as error:
            self.failure = str(error)
            to_send.clear()
            self._phase.enter(Mode.FAILED, EventKind.BRING_UP_FAILED(why=self.failure))
            return False

    def judge(self) -> Verdict:
        """What was heard meanwhile is latched once there is a stop to latch."""
        if not self._intruders:
            return PASS
        heard = f"{self._intruders} frames that only a master sends during bring-up"
        return Verdict(Reaction.RAMP, "second_master", heard)
