"""Builds the simulated redundant interface from its configuration."""

from __future__ import annotations

import numpy as np

from ...devices.network import Network
from ...models import Array, Robot
from ...sim.hand import Grip, Hand, Path, PointHand, turned
from ...sim.rigid import RigidArm
from ..rendering.own_plant import heavier
from .config import RhiConfig, RhiHand
from .plant import RhiPlant
from .redundant import PLACE


def rhi_plant(config: RhiConfig, robot: Robot, network: Network) -> RhiPlant:
    """The plant, at rest in its initial posture."""
    simulation, motors = config.simulation, config.rhi.motors
    assert simulation is not None
    plant, hand = simulation.rhi, simulation.hand
    turns = len(config.rhi.task.directions) > PLACE
    arm = RigidArm(
        heavier(robot, robot.names, plant.masses),
        config.rhi.task.frame,
        np.array(motors.transmission),
        np.array(motors.rotor_inertia),
        np.array(plant.friction),
        np.array(plant.brake_torque),
        6 if turns else 3,
    )
    arm.reset(np.array(plant.posture))
    return RhiPlant(
        network,
        arm,
        _turning(hand, arm.rotation.copy()) if turns else _moving(hand),
        (plant.force_noise, plant.torque_noise or 0.0),
        plant.substeps,
        [(float(press.at), press.pressed) for press in hand.dead_man],
        simulation.seed,
    )


def _moving(hand: RhiHand) -> PointHand:
    """The handle turns freely in it."""
    path = Path([float(place.at) for place in hand.path], np.array([place.position for place in hand.path]))
    return PointHand(path, hand.stiffness, hand.damping, hand.force)


def _turning(hand: RhiHand, first: Array) -> Hand:
    """It holds the handle's orientation, too, at first (3, 3)."""
    places = [[*place.position, *(place.turned or (0.0,) * 3)] for place in hand.path]
    grip = Grip(
        (hand.stiffness, hand.rotational_stiffness or 0.0),
        (hand.damping, hand.rotational_damping or 0.0),
        (hand.force, hand.torque or 0.0),
    )
    return Hand(Path([float(place.at) for place in hand.path], np.array(places)), grip, turned(first))
