"""What a redundant interface's configuration and its model must agree in."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ...models import Array, Robot
from .config import RhiConfig

Found = list[tuple[str, str, str]]
ROUNDING = 1e-9
UPRIGHT = 1e-3
"""Largest sine of the angle between an axis and where it does no work against gravity."""


def check_model(config: RhiConfig, robot: Robot) -> Found:
    """Limits beyond those of the joints, friction that nobody computes, axes that carry weight."""
    return _limits(config, robot) + _friction(robot) + _gravity(robot)


def _limits(config: RhiConfig, robot: Robot) -> Found:
    """Torques, speeds and angles of the motors, as the joints of the chain see them: r = T q.

    Joint torques are T^-T tau, so that the power is the same; the worst case has every motor at its limit
    with the worst sign.
    """
    motors, T = config.rhi.motors, np.array(config.rhi.motors.transmission)
    lower, upper = np.array(motors.lower), np.array(motors.upper)
    middle, half = T @ (lower + upper) / 2.0, np.abs(T) @ (upper - lower) / 2.0
    torque = np.abs(np.linalg.inv(T).T) @ np.array(motors.torque)
    speed = np.abs(T) @ np.array(motors.velocity)
    found: Found = []
    for key, reached, allowed, sign in (
        ("torque", torque, robot.effort, 1.0),
        ("velocity", speed, robot.velocity, 1.0),
        ("upper", middle + half, robot.upper, 1.0),
        ("lower", middle - half, robot.lower, -1.0),
    ):
        found += [
            (f"rhi.motors.{key}", f"takes {name} to {have:g}, the model's limit is {most:g}", "stay inside")
            for name, have, most in zip(robot.names, reached.tolist(), allowed.tolist(), strict=True)
            if sign * (have - most) > ROUNDING * (1.0 + abs(have))
        ]
    return found


def _friction(robot: Robot) -> Found:
    if not robot.damping.any():
        return []
    problem = "the model damps joints, and neither controller nor plant would"
    return [("model", problem, "write damping 0 there, and friction of the motors here")]


def _gravity(robot: Robot) -> Found:
    """The controller computes no gravity, so no posture may need any.

    A turning joint does no work against gravity where its axis stands upright, a sliding one where it lies
    level; joints that turn about upright axes leave both as they are, so one posture tells for all.
    """
    model, data = robot.model, robot.data
    if not model.gravity.linear.any():
        return []
    down: Array = model.gravity.linear / np.linalg.norm(model.gravity.linear)
    J = pin.computeJointJacobians(model, data, robot.configuration(np.zeros(robot.nv)))
    for i, name in enumerate(robot.names):
        linear, angular = J[:3, i], J[3:, i]
        turns = bool(angular.any())
        tilt = np.linalg.norm(np.cross(angular, down)) if turns else abs(float(linear @ down))
        if tilt > UPRIGHT:
            fix = "turn the model until turning joints stand upright and sliding ones lie level"
            return [("model", f"{name} carries weight, and the controller computes no gravity", fix)]
    return []
