"""A drive of a joint that slides."""

from __future__ import annotations

from ..configs.quantities import AnyLength, Length
from .torque_drive import TorqueDrive


class SlideDrive(TorqueDrive, frozen=True, kw_only=True, tag="slide_drive"):
    """A joint that slides on a spindle, whose shaft the drive turns.

    Attributes:
        lead: of the spindle, way in a turn of the shaft [m].
    """

    lead: Length
    zero: AnyLength = AnyLength(0.0)
    link_zero: AnyLength = AnyLength(0.0)

    @property
    def travel(self) -> float:
        """Way of the joint in a turn of the shaft [m]."""
        return float(self.lead)
