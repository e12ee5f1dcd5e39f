"""The simulated arm: links, hand and sensor behind its simulated devices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...devices.network import Network
from ...sim.delay import Delay
from ...sim.drive import Drives
from ...sim.dynamics import HeldArm
from ...sim.force_torque import SimForceTorque
from ...sim.hand import Hand
from ...sim.plant import Energies, SimPlant
from ...sim.probes import Probe, Probes
from ...sim.tool import SensedTool
from ...sim.torque_drive import SimTorqueDrive
from ..rendering.giving_way import Pushes

GRAVITY = np.array([0.0, 0.0, -9.81])
STILL = np.zeros(3)
"""Acceleration of a base that stands."""


class ArmPlant(SimPlant):
    """An arm whose handle is in a hand.

    Attributes:
        arm, hand, tool: the parts.
    """

    def __init__(
        self,
        network: Network,
        arm: HeldArm,
        hand: Hand,
        tool: SensedTool,
        noise: tuple[float, float],
        dead_man: Sequence[tuple[float, bool]],
        seed: int,
        delay: int = 0,
        pushes: Pushes | None = None,
    ) -> None:
        """Standard deviations of the sensor's noise [N, N m]; times at which the switch changes [s].

        The drives obey delay ticks late.
        """
        super().__init__(network, hand, dead_man, seed)
        self.arm, self.hand, self.tool = arm, hand, tool
        self._noise = np.repeat(noise, 3)
        self._joints = joints = Drives(self.nodes.of(SimTorqueDrive))
        (force_torque,) = self.nodes.of(SimForceTorque)
        self._probes = Probes(
            [
                Probe(joints["position"], arm.motor),
                Probe(joints["velocity"], arm.motor_rate),
                Probe(joints["link_position"], arm.q),
                Probe(joints["load_torque"], arm.spring),
                Probe(force_torque.fields["wrench"], tool.felt, self._noise),
            ],
            self._random,
        )
        self.wrench = arm.hold.wrench
        self._pushes = pushes
        self._late = Delay(delay, len(joints.command))
        tool.base[:] = -GRAVITY
        self._measure()

    def energies(self) -> Energies:
        """The base stands."""
        arm = self.arm
        return Energies(arm.kinetic_energy(), arm.spring_energy(), arm.potential_energy(), self.hand_power)

    @property
    def hand_power(self) -> float:
        """See ``SimPlant``."""
        return float(self.wrench @ self.arm.twist)

    def _move(self, dt: float) -> None:
        arm, joints = self.arm, self._joints
        self.hand.aim(arm.hold, self.time, arm.position, arm.rotation)
        joints.update()
        if self._pushes:
            self._pushes.apply(self.time, arm.q, arm.push)
        arm.step(self._late(joints.command, joints.braked), joints.braked, STILL, dt)

    def _sense(self) -> None:
        self.tool.update()
        self._probes.read()
