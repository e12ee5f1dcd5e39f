"""Whether the simulated giant can be what its configuration says."""

from __future__ import annotations

import numpy as np

from ...models import Robot
from ..rendering.check import Found, check_inertia, check_springs, check_weight
from ..rendering.giving_way import check_pushes
from ..rendering.own_plant import check_own_plant, own_robot
from .config import GiantConfig
from .names import JOINTS, PPU_JOINTS
from .simulation import springs


def check_plant(config: GiantConfig, robot: Robot) -> Found:
    """An initial posture out of limits or too heavy to hold, springs too fast, a handle no body has."""
    if config.simulation is None:
        return []
    plant, giant = config.simulation.giant, config.giant
    found: Found = []
    for key, places, names, lower, upper in (
        ("posture", plant.posture, JOINTS, giant.manipulator.lower, giant.manipulator.upper),
        ("ppu", plant.ppu, PPU_JOINTS, giant.ppu.lower, giant.ppu.upper),
    ):
        for name, q, low, high in zip(names, places, lower, upper, strict=True):
            if not low <= q <= high:
                problem = f"{q:g} of {name} is outside {low:g} to {high:g}"
                found.append((f"simulation.giant.{key}", problem, "begin inside the limits"))
    found += check_inertia("simulation.giant.handle_inertia", plant.handle_inertia)
    if wrong := check_own_plant(config.simulation.plant, len(JOINTS), yields=True):
        return found + wrong
    arm = own_robot(robot, JOINTS, config.simulation.plant).without(PPU_JOINTS)
    posture = np.array(plant.posture)
    found += check_pushes(arm, config.simulation.pushes or ())
    found += check_weight(arm, posture, plant.brake_torque, ["simulation.giant.brake_torque"] * len(JOINTS))
    rotor, stiffness = springs(config)
    return found + check_springs(
        "simulation.giant.substeps",
        arm,
        posture,
        (rotor, stiffness, np.array(plant.spring_damping)),
        arm.damping,
        plant.substeps,
        1.0 / config.loop.rate,
    )
