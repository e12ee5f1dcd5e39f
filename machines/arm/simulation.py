"""Builds the simulated arm from its configuration."""

from __future__ import annotations

import numpy as np

from ...devices.network import Network
from ...models import Array, Robot
from ...sim.dynamics import DirectArm, HeldArm, SeriesElasticArm
from ...sim.hand import Grip, Hand, Path, turned
from ...sim.tool import SensedTool, Tool
from ..rendering.giving_way import Pushes
from ..rendering.own_plant import each, own_friction, own_robot
from ..rendering.rendering import sensor_pose
from ..rendering.tool import own_handle
from .config import ArmConfig
from .plant import ArmPlant


def arm_plant(config: ArmConfig, robot: Robot, network: Network) -> ArmPlant:
    """The plant, at rest in its initial posture."""
    simulation, frames = config.simulation, config.arm.frames
    assert simulation is not None
    plant, hand = simulation.arm, simulation.hand
    arm = _arm(config, robot)
    path = Path(
        [float(point.at) for point in hand.path],
        np.array([[*point.position, *point.turned] for point in hand.path]),
    )
    grip = Grip(
        (hand.stiffness, hand.rotational_stiffness or 0.0),
        (hand.damping, hand.rotational_damping or 0.0),
        (hand.force, hand.torque or 0.0),
    )
    T = sensor_pose(robot, frames.handle, frames.sensor)
    tool = own_handle(config.arm.handle, robot, frames.handle, frames.sensor)
    R, own = T[:3, :3], Tool(tool.mass, tool.centre, plant.handle_inertia)
    return ArmPlant(
        network,
        arm,
        Hand(
            path,
            grip,
            turned(arm.rotation.copy()),
            [(away.at, away.at + away.seconds) for away in hand.away or ()],
        ),
        SensedTool(own, (R.T @ T[:3, 3]).tolist(), arm, arm.hold.wrench, R),
        (plant.force_noise, plant.torque_noise),
        [(float(press.at), press.pressed) for press in hand.dead_man],
        simulation.seed,
        simulation.plant.delay,
        Pushes(robot, simulation.pushes or ()),
    )


def plant_values(config: ArmConfig, robot: Robot) -> tuple[Array, Array, Array]:
    """What the plant has, where it differs from what the controller believes.

    Returns:
        Rotor inertia, stiffness of the springs (0 where nothing yields), viscous friction, (m,) each.
    """
    assert config.simulation is not None
    plant, m = config.simulation.plant, len(config.arm.joints)
    rows = zip(config.arm.joints.values(), config.simulation.arm.joints.values(), robot.damping, strict=True)
    values = [
        (
            joint.rotor_inertia if own.rotor_inertia is None else own.rotor_inertia,
            (joint.stiffness or 0.0) if own.stiffness is None else own.stiffness,
            damping if own.friction is None else own.friction,
        )
        for joint, own, damping in rows
    ]
    factors = [each(x, m) for x in (plant.rotor_inertia, plant.stiffness, plant.viscous_friction)]
    rotor, stiffness, friction = np.ascontiguousarray(np.array(values, float).T * factors)
    return rotor, stiffness, friction


def _arm(config: ArmConfig, robot: Robot) -> HeldArm:
    assert config.simulation is not None
    plant, handle = config.simulation.arm, config.arm.frames.handle
    joints = plant.joints.values()
    rotor, stiffness, friction = plant_values(config, robot)
    own = own_robot(robot, robot.names, config.simulation.plant)
    own.damping = friction
    dry = own_friction(own, config.simulation.plant)
    brake = np.array([joint.brake for joint in joints], float)
    arm: SeriesElasticArm | DirectArm
    if stiffness.any():
        damping = np.array([joint.spring_damping or 0.0 for joint in joints], float)
        arm = SeriesElasticArm(own, handle, rotor, stiffness, damping, brake, plant.substeps, dry)
    else:
        arm = DirectArm(own, handle, rotor, brake, plant.substeps, dry)
    arm.reset(np.array([joint.start for joint in joints], float))
    return arm
