"""Builds the simulated giant from its configuration."""

from __future__ import annotations

import numpy as np

from ...devices.network import Network
from ...models import Array, Robot
from ...sim.dynamics import SeriesElasticArm, VelocityAxes
from ...sim.hand import Grip, Hand, Path, hanging
from ...sim.tool import Tool
from ..rendering.giving_way import Pushes
from ..rendering.own_plant import each, own_friction, own_robot
from ..rendering.tool import own_handle
from .config import GiantConfig
from .names import JOINTS, PPU_JOINTS
from .plant import GiantPlant, Noise

HARD_STOP = 0.15
"""How far behind its limits the gantry's hard stops are [m]."""


def giant_plant(config: GiantConfig, robot: Robot, network: Network) -> GiantPlant:
    """The plant, at rest in its initial posture."""
    simulation, giant = config.simulation, config.giant
    assert simulation is not None
    plant, hand = simulation.giant, simulation.hand
    own, (rotor, stiffness) = own_robot(robot, JOINTS, simulation.plant), springs(config)
    arm_alone = own.without(PPU_JOINTS)
    arm = SeriesElasticArm(
        arm_alone,
        "handle",
        rotor,
        stiffness,
        np.array(plant.spring_damping),
        np.array(plant.brake_torque),
        plant.substeps,
        own_friction(arm_alone, simulation.plant),
    )
    arm.reset(np.array(plant.posture))
    ppu = VelocityAxes(
        giant.ppu.time_constant,
        giant.ppu.acceleration,
        [lower - HARD_STOP for lower in giant.ppu.lower],
        [upper + HARD_STOP for upper in giant.ppu.upper],
    )
    ppu.position[:] = plant.ppu
    pushes = Pushes(arm_alone, simulation.pushes or ())
    path = Path(
        [float(point.at) for point in hand.path],
        np.array([[*point.position, *point.angles] for point in hand.path]),
    )
    grip = Grip(
        (hand.stiffness, hand.rotational_stiffness),
        (hand.damping, hand.rotational_damping),
        (hand.force, hand.torque),
    )
    tool = own_handle(giant.handle, robot, "handle", "force_torque")
    return GiantPlant(
        network,
        own,
        arm,
        ppu,
        Hand(path, grip, hanging, [(away.at, away.at + away.seconds) for away in hand.away or ()]),
        Tool(tool.mass, tool.centre, plant.handle_inertia),
        Noise(plant.force_noise, plant.torque_noise, plant.acceleration_noise),
        [(float(press.at), press.pressed) for press in hand.dead_man],
        simulation.seed,
        simulation.plant.delay,
        pushes,
        config.leads,
    )


def springs(config: GiantConfig) -> tuple[Array, Array]:
    """Rotor inertia [kg m^2] and stiffness [N m/rad] of the simulated joints, (6,) each."""
    simulation, tracking = config.simulation, config.giant.tracking
    assert simulation is not None
    rotor, stiffness = (
        each(x, len(JOINTS)) for x in (simulation.plant.rotor_inertia, simulation.plant.stiffness)
    )
    return rotor * tracking.rotor_inertia, stiffness * tracking.stiffness
