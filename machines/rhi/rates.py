"""Whether a redundant interface's gains and its plant's friction are slow enough for their rates."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ...models import Robot
from ...runtime.core.sampling import controls, fastest, integrates
from .config import RhiConfig
from .guard import SPEED, STOP
from .machine import redundant_arm

Found = list[tuple[str, str, str]]
BRAKES_S = 0.14
"""Longest time in which a motor brakes from the speed that the posture keeps [s]: twice HORIZON of
csrc/guard.c. One that needs longer comes to rest behind the limit in front of which it is to."""

MOST_PULL = 4.0
"""Of the pull on the posture, over the torque of the weakest motor, which has to brake what it moves."""


def check_rates(config: RhiConfig, robot: Robot) -> Found:
    """Gains and friction that act faster than the period in which they are computed."""
    rhi, dt = config.rhi, 1.0 / config.loop.rate
    T = np.array(rhi.motors.transmission)
    q = config.simulation.rhi.posture if config.simulation is not None else rhi.task.home
    links = pin.crba(robot.model, robot.data, robot.configuration(T @ np.array(q)))
    M = T.T @ (np.triu(links) + np.triu(links, 1).T) @ T + np.diag(rhi.motors.rotor_inertia)
    inverse = np.linalg.inv(M)
    found: Found = []
    for key, spring, damper in (
        ("rhi.hold", np.array(rhi.hold.stiffness), np.array(rhi.hold.damping)),
        (
            "rhi.null_space",
            np.full(robot.nv, rhi.null_space.stiffness),
            np.full(robot.nv, rhi.null_space.damping),
        ),
        (
            "rhi.null_space.margin",
            np.array(rhi.motors.torque) / (STOP * rhi.null_space.margin),
            np.zeros(robot.nv),
        ),
    ):
        if not controls(fastest(inverse, spring), fastest(inverse, damper), dt):
            problem = f"its spring or damper acts faster than one period of {dt:g} s"
            found.append((key, problem, "lower the gains, or raise the rate"))
    for key, time in (
        ("rhi.saturation.release", rhi.saturation.release),
        ("rhi.task.follow", rhi.task.follow),
    ):
        if time is not None and time < dt:
            problem = f"{time:g} s is less than one period of {dt:g} s"
            found.append((key, problem, "give at least a period"))
    if config.simulation is not None:
        plant = config.simulation.rhi
        if not integrates(0.0, fastest(inverse, np.array(plant.friction)), dt / plant.substeps):
            problem = f"{plant.substeps} are too few for the friction in steps of {dt / plant.substeps:g} s"
            found.append(("simulation.rhi.substeps", problem, "give more, or less friction"))
    return found


def check_braking(config: RhiConfig, robot: Robot) -> Found:
    """Motors that the posture may turn faster than they can brake in front of a limit."""
    return _fast(config, robot) + _pulled(config, robot)


def _pulled(config: RhiConfig, robot: Robot) -> Found:
    """Motors that are much weaker than the pull on the posture."""
    cap, torque = config.rhi.null_space.cap, config.rhi.motors.torque
    weakest = min(torque)
    if len(config.rhi.task.directions) == robot.nv or cap <= MOST_PULL * weakest:
        return []
    name = torque.index(weakest) + 1
    problem = f"{cap:g} N m may set going what motor {name} has {weakest:g} N m to brake with"
    return [("rhi.null_space.cap", problem, f"give at most {MOST_PULL * weakest:.3g} N m")]


def _fast(config: RhiConfig, robot: Robot) -> Found:
    """Of single motors, in the home posture."""
    motors = config.rhi.motors
    if not robot.model.existFrame(config.rhi.task.frame):
        return []  # named elsewhere
    arm = redundant_arm(config, robot).at(np.array(config.rhi.task.home))
    inertia, left = np.diag(arm.M), np.array(motors.torque) - np.abs(arm.weight)
    found: Found = []
    rows = zip(motors.velocity, inertia.tolist(), left.tolist(), strict=True)
    for i, (speed, heavy, torque) in enumerate(rows, 1):
        able = BRAKES_S * torque / (SPEED * heavy)
        if 0.0 < able < speed:
            needed = SPEED * speed * heavy / torque
            problem = (
                f"{speed:g} rad/s of motor {i}: in the home posture the {torque:.3g} N m beside the weight"
                f" need {needed:.2g} s to brake {heavy:.3g} kg m^2"
            )
            fix = f"allow it at most {able:.3g} rad/s, or give it more torque"
            found.append(("rhi.motors.velocity", problem, fix))
    return found
