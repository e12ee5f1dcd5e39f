"""Whether the simulated giant can be what its configuration says."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ...models import Robot
from ..sampling import fastest, integrates
from .config import GiantConfig
from .names import JOINTS, PPU_JOINTS

Found = list[tuple[str, str, str]]


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
    low, mid, high = sorted(plant.handle_inertia)
    if low + mid < high * (1.0 - 1e-6):
        problem = f"{plant.handle_inertia} belong to no rigid body"
        found.append(("simulation.giant.handle_inertia", problem, "none is above the sum of the others"))
    return found + _weight(config, robot) + _springs(config, robot)


def _weight(config: GiantConfig, robot: Robot) -> Found:
    """Gravity in the initial posture beside brakes and motors."""
    assert config.simulation is not None
    plant, arm = config.simulation.giant, robot.without(PPU_JOINTS)
    q = arm.configuration(np.array(plant.posture))
    gravity = np.abs(pin.computeGeneralizedGravity(arm.model, arm.data, q)).tolist()
    found: Found = []
    for name, weight, brake, effort in zip(JOINTS, gravity, plant.brake_torque, arm.effort, strict=True):
        if weight > brake:
            problem = f"{brake:g} N m of {name} do not hold its {weight:g} N m of gravity"
            found.append(("simulation.giant.brake_torque", problem, "give a stronger brake"))
        if weight > effort:
            problem = f"the effort {effort:g} N m of {name} does not hold its {weight:g} N m of gravity"
            found.append(("model", problem, "mend masses or efforts"))
    return found


def _springs(config: GiantConfig, robot: Robot) -> Found:
    """Springs between rotors and links beside the substeps that integrate them."""
    assert config.simulation is not None
    plant, arm = config.simulation.giant, robot.without(PPU_JOINTS)
    tracking, h = config.giant.tracking, 1.0 / (config.loop.rate * plant.substeps)
    links = pin.crba(arm.model, arm.data, arm.configuration(np.array(plant.posture)))
    inverse = np.linalg.inv(np.triu(links) + np.triu(links, 1).T)
    both = inverse + np.diag(1.0 / np.array(tracking.rotor_inertia))
    stiffness = fastest(both, np.array(tracking.stiffness))
    damping = fastest(both, np.array(plant.spring_damping)) + fastest(inverse, arm.damping)
    if integrates(stiffness, damping, h):
        return []
    problem = f"{plant.substeps} are too few for springs, dampers and inertias in steps of {h:g} s"
    return [("simulation.giant.substeps", problem, "give more, or softer springs and dampers")]
