"""A glove of the operator: its joints go to the avatar, whose currents come back as brakes."""

from __future__ import annotations

from collections.abc import Sequence

from ...control.hands import Brakes, felt_by
from ...devices.image import ProcessImage
from ...devices.remote import ENGAGED, WAITING, unpacked
from ...devices.remote_hand import RemoteHands
from ...devices.sense_glove import FINGERS, SenseGloves


class OperatorGlove:
    """Between process image and gate.

    Attributes:
        brakes: which fingers are held.
    """

    def __init__(self, row: int, drives: Sequence[str], image: ProcessImage, dt: float) -> None:
        """Which of the gloves; names of the drives of the hand at the other side."""
        self._row, self._gloves, self._hands = row, SenseGloves(image), RemoteHands(image)
        self._current = self._hands.current[row]
        self._angle, self._told = self._gloves.angle[row], image["remote_hands.angle"][row]
        self.brakes = Brakes(felt_by(drives, FINGERS), dt)

    def say(self, leads: bool) -> None:
        """Where the fingers are, and whether that is to be followed."""
        self._told[:] = self._angle
        ready = leads and self._gloves.ready(self._row)
        self._hands.own_flags[self._row] = ENGAGED if ready else WAITING

    def update(self, feels: bool, most_age: float) -> None:
        """Hold what the avatar's fingers meet.

        Args:
            feels: whether this arm leads; all brakes open at once where it does not.
            most_age: of what may hold a finger [s].
        """
        flags, _ = unpacked(self._hands.flags.item(self._row))
        if feels and flags & ENGAGED and self._hands.age.item(self._row) <= most_age:
            self.brakes.update(self._current)
            self._gloves.brakes[self._row] = self.brakes.bits
        else:
            self.release()

    def release(self) -> None:
        """Nothing holds the fingers."""
        self.brakes.release()
        self._gloves.brakes[self._row] = 0
