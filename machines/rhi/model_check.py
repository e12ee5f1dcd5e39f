"""What a redundant interface's configuration and its model must agree in."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ...models import Array, Robot
from .config import RhiConfig

Found = list[tuple[str, str, str]]
ROUNDING = 1e-9
CARRIED = 0.8
"""Part of a motor's torque that the arm's own weight may take: the rest is for the hand."""
POSTURES = 2000
"""Random ones in which it is looked up, beside the home posture."""
FEW = 8
"""An arm without weight in so many random postures has none anywhere: it is an analytic function of them."""


def check_model(config: RhiConfig, robot: Robot) -> Found:
    """Limits beyond those of the joints, friction that nobody computes, motors that cannot carry the arm."""
    return _limits(config, robot) + _friction(config, robot) + _gravity(config, robot)


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


def _friction(config: RhiConfig, robot: Robot) -> Found:
    """The motors' friction is all that controller and plant compute, so that of the joints is part of it."""
    T, own = np.array(config.rhi.motors.transmission), np.array(config.rhi.motors.friction)
    seen = T.T @ np.diag(robot.damping) @ T
    if np.abs(seen - np.diag(np.diag(seen))).max() > ROUNDING:
        problem = "the model damps joints that several motors drive, and neither controller nor plant would"
        return [("model", problem, "write damping 0 there, and friction of the motors here")]
    return [
        (
            "rhi.motors.friction",
            f"{have:g} of motor {i}, and the model damps its joint with {least:g} N m s/rad",
            "the friction of a motor includes its joint's: give at least that, or write damping 0 there",
        )
        for i, (have, least) in enumerate(zip(own.tolist(), np.diag(seen).tolist(), strict=True), 1)
        if have < least - ROUNDING
    ]


def _gravity(config: RhiConfig, robot: Robot) -> Found:
    """Motors whose torque the arm's own weight takes, somewhere within their limits."""
    motors, T = config.rhi.motors, np.array(config.rhi.motors.transmission)
    if any(low >= high for low, high in zip(motors.lower, motors.upper, strict=True)):
        return []  # named elsewhere
    drawn = np.random.default_rng(0).uniform(motors.lower, motors.upper, (POSTURES, robot.nv))
    postures: Array = np.vstack([config.rhi.task.home, drawn])
    if max(np.abs(_weight(robot, T @ q)).max() for q in postures[:FEW]) < ROUNDING:
        return []
    weights = np.array([_weight(robot, T @ q) for q in postures]) @ T
    share = np.abs(weights) / np.array(motors.torque)
    found: Found = []
    for i, worst in enumerate(np.argmax(share, axis=0).tolist()):
        if share[worst, i] > CARRIED:
            held, where = abs(weights[worst, i]), " ".join(f"{x:.2f}" for x in postures[worst])
            problem = (
                f"{motors.torque[i]:g} N m of motor {i + 1}: at {where} rad the arm's weight takes {held:.3g}"
            )
            fix = f"give it {held / CARRIED:.3g} N m, or keep it from there by rhi.motors.lower and upper"
            found.append(("rhi.motors.torque", problem, fix))
    return found


def _weight(robot: Robot, joints: Array) -> Array:
    model = robot.model
    torques: Array = pin.computeGeneralizedGravity(model, robot.data, robot.configuration(joints))
    return torques
