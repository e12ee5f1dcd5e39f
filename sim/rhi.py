"""A simulated redundant interface: arm, hand and sensors behind its simulated devices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..devices.frames import Frames
from ..devices.network import Network
from .drives import SimDrive, SimJointDrive
from .hand import PointHand
from .nodes import SimNodes
from .plc import DeadManScript, SimSafetyPlc
from .rigid import RigidArm
from .sensors import SimForceTorque


class RhiPlant:
    """Advances the whole machine by one period of plant time at a time.

    Attributes:
        nodes: the simulated devices.
        arm, hand: the parts.
        time: plant time [s].
    """

    def __init__(
        self,
        network: Network,
        arm: RigidArm,
        hand: PointHand,
        noise: float,
        substeps: int,
        dead_man: Sequence[tuple[float, bool]],
        seed: int,
    ) -> None:
        """Noise of the force sensor [N]; dead_man the times at which the switch changes."""
        self.nodes = SimNodes(network)
        self.arm, self.hand = arm, hand
        self.time = 0.0
        self._noise, self._substeps = noise, substeps
        self._random = np.random.default_rng(seed)
        self._drives = self.nodes.of(SimJointDrive)
        (plc,) = self.nodes.of(SimSafetyPlc)
        self._dead_man = DeadManScript(plc, dead_man)
        (self._force_torque,) = self.nodes.of(SimForceTorque)
        self._force = [0.0] * 3
        self._sense()

    def exchange(self, frames_in: Frames, frames_out: Frames) -> None:
        """Let the devices take frames and answer."""
        self.nodes.receive(frames_in, frames_out)

    def step(self, dt: float) -> None:
        """Advance plant time by dt."""
        arm, h = self.arm, dt / self._substeps
        torque = np.array([drive.torque for drive in self._drives])
        braked = [drive.brake for drive in self._drives]
        for k in range(self._substeps):
            at = self.time + k * h
            self._force = self.hand.force(at, arm.position.tolist(), arm.velocity.tolist())
            arm.step(torque, braked, self._force, h)
        self.time += dt
        self.nodes.advance(dt)
        self._sense()

    @property
    def safe(self) -> bool:
        """Whether every drive is in its safe state: no torque, brake closed."""
        return all(drive.brake for drive in self.nodes.of(SimDrive))

    def _sense(self) -> None:
        arm = self.arm
        rows = (self._drives, arm.q.tolist(), arm.qd.tolist())
        for drive, angle, rate in zip(*rows, strict=True):
            drive.position = drive.link_position = angle
            drive.velocity, drive.load_torque = rate, drive.torque
        force = arm.rotation.T @ self._force + self._noise * self._random.standard_normal(3)
        self._force_torque.wrench = [*force.tolist(), 0.0, 0.0, 0.0]
        self._dead_man.advance(self.time)
