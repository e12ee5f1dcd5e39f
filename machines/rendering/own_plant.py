"""A simulated machine that is not what its controller believes: masses, rotors, springs, friction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ...models import Array, Robot
from ...sim.friction import Friction
from .check import Found
from .sections import Plant


def each(values: float | Sequence[float], n: int) -> Array:
    """One number for all joints, or one each, as (n,)."""
    return np.array(np.broadcast_to(np.array(values, float), n))


def own_robot(robot: Robot, joints: Sequence[str], plant: Plant) -> Robot:
    """The robot with the plant's masses, inertias and viscous friction of what joints (m,) carry."""
    own, damping = heavier(robot, joints, plant.masses), robot.damping.copy()
    damping[[robot.names.index(name) for name in joints]] *= each(plant.viscous_friction, len(joints))
    own.model.damping = own.damping = damping
    return own


def heavier(robot: Robot, joints: Sequence[str], factors: float | Sequence[float]) -> Robot:
    """The robot with so many times the masses and inertias of what joints (m,) carry."""
    model = robot.model.copy()
    own = Robot(model)
    for name, factor in zip(joints, each(factors, len(joints)), strict=True):
        joint = model.getJointId(name)
        body = model.inertias[joint]
        model.inertias[joint] = pin.Inertia(factor * body.mass, body.lever, factor * body.inertia)
    return own


def own_friction(robot: Robot, plant: Plant) -> Friction:
    """Dry friction of all joints of a robot, (nv,); it is given as shares of their efforts."""
    n = robot.nv
    gear, bearing = each(plant.gear_friction, n), each(plant.bearing_friction, n)
    return Friction(gear * robot.effort, each(plant.load_friction, n), bearing * robot.effort)


def check_own_plant(plant: Plant, joints: int, yields: bool) -> Found:
    """Lists of another length than there are joints, and springs where nothing yields."""
    found: Found = []
    for key in plant.__struct_fields__:
        value = getattr(plant, key)
        if isinstance(value, tuple) and len(value) != joints:
            problem = f"has {len(value)} numbers for {joints} joints"
            found.append((f"simulation.plant.{key}", problem, "give one for all, or one each"))
    if not yields and plant.stiffness != 1.0:
        fix = "remove it, or give the joints a stiffness"
        found.append(("simulation.plant.stiffness", "is of no spring", fix))
    return found
