"""What the plant's motion costs: kinetic energy, and the work of hand, gravity, and of everything else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from hapticd.models import Robot
from hapticd.runtime.session import Session
from hapticd.sim.giant import GiantPlant
from hapticd.sim.rhi import RhiPlant


class Energy:
    """Follows a plant from the moment it is made, one ``take`` a tick.

    Attributes:
        kinetic: of links, rotors and whatever the gantry carries, as seen from the room [J].
        spring: energy in the springs of the joints [J].
        hand, gravity: their work so far [J].
        lifted: the part of gravity's work that it took, not gave: positive [J].
    """

    def __init__(self, session: Session, plant: Any) -> None:
        self._plant = plant
        self._of = _giant if isinstance(plant, GiantPlant) else _rhi
        self._robot, self._config = session.robot, session.config
        self.hand = self.gravity = self.lifted = 0.0
        self._measure()

    def take(self, dt: float) -> None:
        potential, power = self._potential, self._power
        self._measure()
        self.hand += 0.5 * dt * (power + self._power)
        fallen = potential - self._potential
        self.gravity += fallen
        self.lifted += max(0.0, -fallen)

    def _measure(self) -> None:
        self.kinetic, self.spring, self._potential, self._power = self._of(
            self._robot, self._config, self._plant
        )


def _giant(robot: Robot, config: Any, plant: GiantPlant) -> tuple[float, float, float, float]:
    arm, ppu, tracking = plant.arm, plant.ppu, config.giant.tracking
    q = robot.configuration(np.array([*ppu.position, *arm.q]))
    qd = np.array([*ppu.velocity, *arm.qd])
    rotor, stiffness = np.array(tracking.rotor_inertia), np.array(tracking.stiffness)
    kinetic = pin.computeKineticEnergy(robot.model, robot.data, q, qd)
    kinetic += 0.5 * rotor.dot(arm.motor_rate**2)
    twist = arm.twist.copy()
    twist[:2] += ppu.velocity
    potential = pin.computePotentialEnergy(robot.model, robot.data, q)
    spring = 0.5 * stiffness.dot((arm.motor - arm.q) ** 2)
    return kinetic, spring, potential, float(plant._wrench @ twist)


def _rhi(robot: Robot, config: Any, plant: RhiPlant) -> tuple[float, float, float, float]:
    return plant.arm.energy(), 0.0, 0.0, float(np.dot(plant._force, plant.arm.velocity))
