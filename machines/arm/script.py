"""The simulated hand that leads an arm's twin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from ...models import Robot
from ..rendering.script import path_of
from .config import ArmConfig


def arm_led(config: ArmConfig, robot: Robot, hand: Mapping[str, Any]) -> str:
    """Path of a hand that leads the twin from the simulated posture; see ``System.led``."""
    assert config.simulation is not None
    q = np.array([joint.start for joint in config.simulation.arm.joints.values()], float)
    handle = robot.placement(q, config.arm.frames.handle)
    first = handle[:3, :3].T
    return path_of(config.arm.twin, hand, handle, lambda R: tuple(pin.log3(R @ first).tolist()), "turned")
