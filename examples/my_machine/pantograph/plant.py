"""The simulated pantograph in motor coordinates; a forearm counts half at its elbow, half at the handle."""

import numpy as np
from hapticd.sim.friction import braked_speed
from hapticd.sim.hand import Path, PointHand
from hapticd.sim.joint_drive import SimJointDrive
from hapticd.sim.plant import Energies, SimPlant

from .linkage import Linkage
from .planar_force import SimPlanarForce


class PantographPlant(SimPlant):
    def __init__(self, config, robot, network) -> None:
        self._own, hand = config.simulation, config.simulation.hand
        path = Path([float(place.at) for place in hand.path], np.array([at.position for at in hand.path]))
        self._hand = PointHand(path, hand.stiffness, hand.damping, hand.force)
        presses = [(float(press.at), press.pressed) for press in hand.dead_man]
        super().__init__(network, self._hand, presses, self._own.seed)
        self._drives = self.nodes.of(SimJointDrive)
        (self._sensor,) = self.nodes.of(SimPlanarForce)
        self._linkage = Linkage(robot, config.pantograph.base)
        upper, fore = robot.model.inertias[1], robot.model.inertias[2]
        arm = upper.inertia[2, 2] + upper.mass * upper.lever @ upper.lever + self._own.rotor_inertia
        self._arms, self._mass = (arm + 0.5 * fore.mass * self._linkage.upper**2) * np.eye(2), fore.mass
        self._q, self._qd, self._force = np.array(self._own.posture), np.zeros(2), np.zeros(2)
        self._measure()

    def energies(self) -> Energies:
        _, J, M = self._mechanics()
        return Energies(float(0.5 * self._qd @ M @ self._qd), 0.0, 0.0, float(self._force @ J @ self._qd))

    def _mechanics(self):
        handle, J = self._linkage.at(self._q)
        return handle, J, self._arms + self._mass * J.T @ J

    def _move(self, dt: float) -> None:
        q, qd, (handle, J, M) = self._q, self._qd, self._mechanics()
        self._force = np.array(self._hand.force(self.time, (*handle, 0.0), (*(J @ qd), 0.0))[:2])
        drift = (self._linkage.at(q + (nudge := 1e-6) * qd)[1] - J) @ qd / nudge
        torque = np.array([drive.torque for drive in self._drives]) - self._own.friction * qd
        qdd = np.linalg.solve(M, torque + J.T @ (self._force - self._mass * drift))
        brakes = [drive.brake for drive in self._drives]
        qd[:] = braked_speed(M, qd + dt * qdd, brakes, np.full(2, dt * self._own.brake_torque))
        q += dt * qd

    def _sense(self) -> None:
        for drive, q, qd in zip(self._drives, self._q.tolist(), self._qd.tolist(), strict=True):
            drive.position, drive.link_position, drive.velocity = q, q, qd
            drive.load_torque = drive.torque
        self._sensor.force = (self._force + self._own.noise * self._random.standard_normal(2)).tolist()
