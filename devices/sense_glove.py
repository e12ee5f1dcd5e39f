"""A glove that measures a hand's joints and can stop each finger from closing further."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from .cia301 import Address
from .device import Device, Field, Quantity, Word
from .force_torque import READY
from .group import Group, Quantities, Words
from .image import ProcessImage

FINGERS: Final = ("thumb", "index", "middle", "ring", "little")
JOINTS: Final = ("abduction", "proximal", "middle", "distal")
"""Of each finger, from the palm on; all but the first flex."""
GLOVE_JOINTS: Final = tuple(f"{finger}_{joint}" for finger in FINGERS for joint in JOINTS)
ANGLE: Final = 1e-4
"""Of a count [rad]: 16 bits hold 3.2 rad to either side."""


class SenseGlove(Device, frozen=True, kw_only=True, tag="sense_glove"):
    """Twenty joint angles, and a brake for each finger: bit i of ``brakes`` is finger i's."""

    group: str = "gloves"
    eds: str = "sense_glove.eds"

    def inputs(self) -> Mapping[Address, Field]:
        """Angles in the order of GLOVE_JOINTS [rad], positive where a finger closes, and status."""
        return {
            **{(0x2600, i): Quantity("angle", ANGLE) for i in range(1, len(GLOVE_JOINTS) + 1)},
            (0x2601, 0): Word("status"),
        }

    def outputs(self) -> Mapping[Address, Field]:
        """Brakes that are closed, a bit each."""
        return {(0x2602, 0): Word("brakes")}


class SenseGloves(Group):
    """The gloves of a group.

    Attributes:
        angle: (n, 20) in the order of GLOVE_JOINTS [rad].
        status: (n,) bits of `force_torque.SensorStatus`.
        brakes: (n,) bits, one a finger from the thumb on; the machine writes them.
    """

    kind = SenseGlove
    angle: Quantities
    status: Words
    brakes: Words

    def __init__(self, image: ProcessImage, group: str = "") -> None:
        super().__init__(image, group)

    def ready(self, i: int) -> bool:
        """Whether a glove says that it measures, and nothing else."""
        return self.status.item(i) == READY
