"""Whether bodies push back slowly enough for the rate at which they are rendered.

What a body asks for is computed from where the hand was measured, and held for a period: it comes 1.5 periods
late in the mean.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...models import Array, Robot
from ...runtime.core.sampling import controls
from .config import RhiAssist, RhiBody, RhiConfig, RhiResist
from .machine import redundant_arm
from .redundant import PLACE

Found = list[tuple[str, str, str]]
POSTURES = 300
"""Random ones of which the lightest is taken, beside those that the configuration names."""
LATE = 1.5
"""Periods."""


def check_walls(config: RhiConfig, robot: Robot) -> Found:
    """Bodies that swing up with whoever holds the handle: the mass of the hand is not counted on."""
    mass, dt = lightest(config, robot), 1.0 / config.loop.rate
    points = _points(config)
    found: Found = []
    for name, body in config.rhi.bodies.items():
        most_k, most_b = mass / dt**2 / points, mass / dt / points
        for key, k in _stiffnesses(body):
            if not controls(points * k / mass, 0.0, dt):
                problem = f"{k:.4g} N/m act faster on {mass:.3g} kg than one period of {dt:g} s"
                found.append((f"rhi.bodies.{name}.{key}", problem, _fix(most_k, "N/m", points)))
        for key, b in _dampings(body):
            if not controls(0.0, points * b / mass, dt):
                problem = f"{b:.4g} N s/m act faster on {mass:.3g} kg than one period of {dt:g} s"
                found.append((f"rhi.bodies.{name}.{key}", problem, _fix(most_b, "N s/m", points)))
    return found


def remarks_on_walls(config: RhiConfig, robot: Robot) -> list[str]:
    """Bodies that chatter in the simulated hand, which damps too little for them.

    A spring that is late takes damping away: K < (b + B) / (delay + T / 2) (Gil et al. 2009), with the
    damping b of the hand and B of the body. That of the motors is left out: it is much less.
    """
    if config.simulation is None:
        return []
    hand, dt, points = config.simulation.hand.damping, 1.0 / config.loop.rate, _points(config)
    found = []
    for name, body in config.rhi.bodies.items():
        stiffness = points * max((k for _, k in _stiffnesses(body)), default=0.0)
        damping = hand + points * max((b for _, b in _dampings(body)), default=0.0)
        if stiffness > damping / (LATE * dt):
            found.append(
                f"the body '{name}' may chatter: {stiffness:.4g} N/m at {config.loop.rate:g} Hz want"
                f" {LATE * dt * stiffness:.3g} N s/m of damping, and hand and body have {damping:.3g}"
            )
    return found


def lightest(config: RhiConfig, robot: Robot) -> float:
    """Least mass that a hand feels along any direction, in any of some postures [kg]."""
    arm, motors = redundant_arm(config, robot), config.rhi.motors
    named = [config.rhi.task.home, *([config.simulation.rhi.posture] if config.simulation else [])]
    drawn = np.random.default_rng(0).uniform(motors.lower, motors.upper, (POSTURES, arm.n))
    moving = min(arm.m, PLACE)

    def mobility(q: Array) -> float:
        arm.at(q)
        J = arm.J[:moving]
        return float(np.linalg.eigvalsh(J @ np.linalg.solve(arm.M, J.T))[-1])

    return 1.0 / max(mobility(q) for q in np.vstack([named, drawn]))


def _points(config: RhiConfig) -> int:
    """Of the tool, all of which a flat body may meet at once."""
    tool = config.rhi.task.tool if len(config.rhi.task.directions) > PLACE else None
    return len(tool or (0,))


def _stiffnesses(body: RhiBody) -> Iterator[tuple[str, float]]:
    """Keys, and the most that the force may grow with the way [N/m]; a spot is told by its own key."""
    if isinstance(body, RhiResist):
        return
    if isinstance(body, RhiAssist):
        yield "soft", body.force / body.soft
        return
    layers = [(f"layers[{i}].stiffness", layer.stiffness) for i, layer in enumerate(body.layers or ())]
    own: Sequence[tuple[str, float]] = [("stiffness", body.stiffness), *layers]
    yield from own
    hardest = max(k for _, k in own)
    yield from ((f"spots[{i}].factor", hardest * spot.factor) for i, spot in enumerate(body.spots or ()))


def _dampings(body: RhiBody) -> Iterator[tuple[str, float]]:
    if not isinstance(body, RhiAssist):
        yield "damping", body.damping


def _fix(most: float, unit: str, points: int) -> str:
    each = f" at each of the tool's {points} points" if points > 1 else ""
    return f"keep it below {most:.3g} {unit}{each}, or raise the rate"
