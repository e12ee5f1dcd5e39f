"""The simulated arm: links, hand and sensor behind its simulated devices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...devices.network import Network
from ...models import Array
from ...sim.delay import Delay
from ...sim.dynamics import HeldArm
from ...sim.force_torque import SimForceTorque
from ...sim.hand import Hand
from ...sim.plant import Energies, SimPlant
from ...sim.tool import SensedTool
from ...sim.torque_drive import SimTorqueDrive

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
        R_handle_sensor: Array,
        noise: tuple[float, float],
        dead_man: Sequence[tuple[float, bool]],
        seed: int,
        delay: int = 0,
    ) -> None:
        """The tool as the sensor's axes have it; standard deviations of its noise [N, N m].

        The drives obey delay ticks late.
        """
        super().__init__(network, hand, dead_man, seed)
        self.arm, self.hand, self.tool = arm, hand, tool
        self._sensor, self._noise = R_handle_sensor, np.repeat(noise, 3)
        self._joints = self.nodes.of(SimTorqueDrive)
        (self._force_torque,) = self.nodes.of(SimForceTorque)
        self._late = Delay(delay, len(self._joints))
        self.wrench = arm.hold.wrench
        self._measure()

    def energies(self) -> Energies:
        """The base stands."""
        arm = self.arm
        power = float(self.wrench @ arm.twist)
        return Energies(arm.kinetic_energy(), arm.spring_energy(), arm.potential_energy(), power)

    def _move(self, dt: float) -> None:
        arm = self.arm
        self.hand.aim(arm.hold, self.time, arm.position.tolist(), arm.rotation)
        torque, brakes = [joint.torque for joint in self._joints], [joint.brake for joint in self._joints]
        arm.step(self._late(torque, brakes), brakes, STILL, dt)

    def _sense(self) -> None:
        arm = self.arm
        measured = (arm.motor.tolist(), arm.motor_rate.tolist(), arm.q.tolist(), arm.spring.tolist())
        for joint, motor, rate, q, spring in zip(self._joints, *measured, strict=True):
            joint.position, joint.velocity, joint.link_position, joint.load_torque = motor, rate, q, spring
        # everything in the sensor's axes
        vectors = (arm.acceleration[:3] - GRAVITY, arm.acceleration[3:], arm.twist[3:])
        rotation = arm.rotation @ self._sensor
        rows = np.array((*vectors, self.wrench[:3], self.wrench[3:])) @ rotation
        wrench = self.tool.sensed(*rows.tolist()) + self._noise * self._random.standard_normal(6)
        self._force_torque.wrench = wrench.tolist()
