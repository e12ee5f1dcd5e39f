"""Whether the hand can get to the bodies of a configuration."""

from __future__ import annotations

import numpy as np

from ...models import Array, Robot
from .bodies import shape
from .body_check import away
from .config import RhiAssist, RhiBody, RhiConfig, RhiPlane, RhiResist, RhiSolid
from .machine import redundant_arm
from .redundant import PLACE

Found = list[tuple[str, str, str]]
POSTURES = 1000
"""Random ones: where they hold the hand is where it can be."""
BETWEEN = 0.1
"""How far a place may be from the next of them and still be in reach [m]."""


def check_reach(config: RhiConfig, robot: Robot) -> Found:
    """Bodies that no posture brings the hand to, and a place of targets that none reaches."""
    arm, motors = redundant_arm(config, robot), config.rhi.motors
    moving = min(arm.m, PLACE)
    drawn = np.random.default_rng(0).uniform(motors.lower, motors.upper, (POSTURES, arm.n))
    hands = arm.reach(drawn)[0][:, :moving]
    tool = config.rhi.task.tool if arm.m > PLACE else None
    near = BETWEEN + max((float(np.linalg.norm(point)) for point in tool or ()), default=0.0)
    found: Found = []
    for k, (name, body) in enumerate(config.rhi.bodies.items()):
        far = _distance(body, hands)
        if k == 0 and isinstance(body, RhiPlane) and config.rhi.null_space.scan:
            far = float(np.linalg.norm(hands - body.point, axis=1).min())
        if far > near:
            key = f"rhi.bodies.{name}.{_placed_by(body)}"
            problem = f"is {far:.2g} m away from everything that the hand can reach"
            found.append((key, problem, "move it, or widen rhi.motors.lower and upper"))
    return found


def _placed_by(body: RhiBody) -> str:
    """The key that says where a body is."""
    if body.point is not None:
        return "point"
    return "vertices" if isinstance(body, RhiSolid) and body.mesh is None else "mesh"


def _distance(body: RhiBody, hands: Array) -> float:
    """Of what a body does from the next of some hands (k, m) [m]."""
    if isinstance(body, RhiAssist):
        return 0.0  # it pulls from everywhere
    if isinstance(body, RhiResist):
        return float(np.linalg.norm(hands - body.point, axis=1).min()) - body.radius
    built = shape(body)
    return min(away(body, built, hand) for hand in hands.tolist())
