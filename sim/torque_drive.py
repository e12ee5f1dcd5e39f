"""What simulated drives of joints have in common, whether they turn or slide."""

from __future__ import annotations

from ..devices.cia402 import CYCLIC_SYNCHRONOUS_TORQUE
from ..devices.torque_drive import TorqueDrive
from ._plant import lib
from .attributes import Stored
from .drive import SimDrive


class SimTorqueDrive(SimDrive):
    """A drive of a joint in torque mode; what slides has metres and newtons.

    Where it may give more than its rated torque for a time, it keeps its own account of that (i2t): once the
    time is used up it folds back to the rated torque and says so (6041h, bit 11: internal limit active), and
    has a fault, 2350h, if it is told more for 100 ms.

    Attributes:
        used: share of that time that is used up, by its account.
        folded: whether it has folded back.
        position: joint angle by the motor encoder [rad].
        link_position: joint angle by the link encoder [rad].
        velocity: of the motor, in joint angles [rad/s].
        load_torque: by the torque sensor [N m].
        target_torque: as received [N m].
    """

    own_mode = CYCLIC_SYNCHRONOUS_TORQUE
    moved_by = "target_torque"
    used = Stored(float, "drive")
    folded = Stored(bool, "drive")
    link_position: float
    load_torque: float
    target_torque: float

    def reset(self) -> None:
        """Power-up."""
        drive, device = self._core.drive, self.device
        assert isinstance(device, TorqueDrive)
        drive.rated, drive.peak, drive.peak_time = device.rated, device.peak, device.peak_time or 0.0
        drive.insisted = 0  # a motor does not cool down because its drive restarts
        super().reset()

    @property
    def torque(self) -> float:
        """What the motor gives, joint side [N m]."""
        return float(lib.peers_command(self._peers.core, self.index))
