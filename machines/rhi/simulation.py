"""Builds the simulated redundant interface from its configuration."""

from __future__ import annotations

import numpy as np

from ...devices.network import Network
from ...models import Robot
from ...sim.hand import Path, PointHand
from ...sim.rigid import RigidArm
from ..rendering.own_plant import heavier
from .config import RhiConfig
from .plant import RhiPlant


def rhi_plant(config: RhiConfig, robot: Robot, network: Network) -> RhiPlant:
    """The plant, at rest in its initial posture."""
    simulation, motors = config.simulation, config.rhi.motors
    assert simulation is not None
    plant, hand = simulation.rhi, simulation.hand
    arm = RigidArm(
        heavier(robot, robot.names, plant.masses),
        config.rhi.task.frame,
        np.array(motors.transmission),
        np.array(motors.rotor_inertia),
        np.array(plant.friction),
        np.array(plant.brake_torque),
    )
    arm.reset(np.array(plant.posture))
    path = Path([float(place.at) for place in hand.path], np.array([place.position for place in hand.path]))
    return RhiPlant(
        network,
        arm,
        PointHand(path, hand.stiffness, hand.damping, hand.force),
        plant.force_noise,
        plant.substeps,
        [(float(press.at), press.pressed) for press in hand.dead_man],
        simulation.seed,
    )
