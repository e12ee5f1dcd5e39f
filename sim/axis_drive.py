"""A simulated drive of a linear axis."""

from __future__ import annotations

from ..devices.cia402 import CYCLIC_SYNCHRONOUS_VELOCITY
from .drive import SimDrive


class SimAxisDrive(SimDrive):
    """A drive in velocity mode.

    Attributes:
        position: [m].
        velocity: [m/s].
        target_velocity: as received [m/s].
    """

    own_mode = CYCLIC_SYNCHRONOUS_VELOCITY
    moved_by = "target_velocity"
    target_velocity: float

    @property
    def velocity_command(self) -> float:
        """What its velocity loop follows [m/s]."""
        return self.target_velocity if self.powered else 0.0
