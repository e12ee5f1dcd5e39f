"""What simulated drives of joints have in common, whether they turn or slide."""

from __future__ import annotations

from ..devices.cia402 import CYCLIC_SYNCHRONOUS_TORQUE
from .drive import SimDrive


class SimTorqueDrive(SimDrive):
    """A drive of a joint in torque mode; what slides has metres and newtons.

    Attributes:
        position: joint angle by the motor encoder [rad].
        link_position: joint angle by the link encoder [rad].
        velocity: of the motor, in joint angles [rad/s].
        load_torque: by the torque sensor [N m].
        target_torque: as received [N m].
    """

    own_mode = CYCLIC_SYNCHRONOUS_TORQUE
    moved_by = "target_torque"
    link_position: float
    load_torque: float
    target_torque: float

    @property
    def torque(self) -> float:
        """What the motor gives, joint side [N m]."""
        return self.target_torque if self.powered else 0.0
