"""The simulated hand that leads the giant's twin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, hypot
from typing import Any

import numpy as np

from ...models import Array, Robot
from ..rendering.script import path_of
from .config import GiantConfig


def giant_led(config: GiantConfig, robot: Robot, hand: Mapping[str, Any]) -> str:
    """Path of a hand that leads the twin from the simulated posture; see ``System.led``."""
    return path_of(config.giant.twin, hand, start(config, robot), angles, "angles")


def start(config: GiantConfig, robot: Robot) -> Array:
    """Pose of the handle, (4, 4), where a simulated session begins [m]."""
    assert config.simulation is not None
    plant = config.simulation.giant
    return robot.placement(np.array([*plant.ppu, *plant.posture]), "handle")


def angles(R: Array) -> Sequence[float]:
    """Yaw, tilt and roll of a handle (3, 3), the inverse of ``hapticd.sim.hand.hanging`` [rad]."""
    tilt = atan2(hypot(R[0, 2], R[1, 2]), -R[2, 2])
    return atan2(-R[1, 2], -R[0, 2]), tilt, atan2(-R[2, 1], R[2, 0])
