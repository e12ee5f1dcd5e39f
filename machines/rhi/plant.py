"""A simulated redundant interface: arm, hand and sensors behind its simulated devices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...devices.network import Network
from ...sim.drive import Drives
from ...sim.force_torque import SimForceTorque
from ...sim.hand import Hand, PointHand
from ...sim.joint_drive import SimJointDrive
from ...sim.plant import Energies, SimPlant
from ...sim.rigid import RigidArm

NOTHING = (0.0, 0.0, 0.0)
"""What else acts on the tip."""


class RhiPlant(SimPlant):
    """A rigid arm whose tip is in a hand: its place alone, or its orientation, too.

    Attributes:
        arm, hand: the parts.
    """

    def __init__(
        self,
        network: Network,
        arm: RigidArm,
        hand: PointHand | Hand,
        noise: tuple[float, float],
        substeps: int,
        dead_man: Sequence[tuple[float, bool]],
        seed: int,
    ) -> None:
        """Noise of the sensor [N], [N m]; dead_man the times at which the switch changes."""
        super().__init__(network, hand, dead_man, seed)
        self.arm, self.hand = arm, hand
        self._noise, self._substeps = np.repeat(noise, 3), substeps
        self._drives = Drives(self.nodes.of(SimJointDrive))
        (self._force_torque,) = self.nodes.of(SimForceTorque)
        self._wrench = arm.hold.wrench
        self._measure()

    def energies(self) -> Energies:
        """Rigid links, without springs."""
        return Energies(
            self.arm.energy(), self.arm.potential(), 0.0, float(np.dot(self._wrench, self.arm.twist))
        )

    def _move(self, dt: float) -> None:
        arm, h = self.arm, dt / self._substeps
        drives = self._drives
        drives.update()
        for k in range(self._substeps):
            self.hand.aim(arm.hold, self.time + k * h, arm.position.tolist(), arm.rotation)
            arm.step(drives.command, drives.braked, NOTHING, h)

    def _sense(self) -> None:
        arm, drives = self.arm, self._drives
        drives.update()
        drives["position"][:] = drives["link_position"][:] = arm.q
        drives["velocity"][:], drives["load_torque"][:] = arm.qd, drives.command
        rows = len(self._wrench)
        wrench = (self._wrench.reshape(-1, 3) @ arm.rotation).ravel()
        wrench += self._noise[:rows] * self._random.standard_normal(rows)
        self._force_torque.wrench = [*wrench.tolist(), 0.0, 0.0, 0.0][:6]
