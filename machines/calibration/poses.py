"""Poses in which gravity comes from all around a sensor, and a way through them inside all limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice

import numpy as np

from ...control.ft_calibration import condition, gravity_at
from ...models import Array, Robot

SWINGS = (0.4, 0.7, 1.0)
"""Parts of the joints' ranges that are tried one after the other: an arm should move no more than it must."""
DRAWN, CANDIDATES = 6000, 300
"""Random places, and how many of them that are inside the limits are looked at."""
GOOD = 1.5
"""Condition number that is sought; 1.22 is the best that there is."""
STEP = 0.1
"""Of a joint on a way, between places that are looked at [rad or m]."""
HASTE = 0.4
"""What a radian or metre of the joint that goes furthest costs, beside the logarithm of what it tells."""
DIRECTIONS = 4
"""Unknowns of the forces: they tell most of how gravity's directions are spread."""


def choose(
    robot: Robot,
    frames: Sequence[str],
    start: Array,
    limits: tuple[Array, Array],
    inside: Callable[[Array], bool],
    count: int,
    seed: int,
) -> tuple[Array, float]:
    """Places of the joints in the order in which they are gone to, and their condition number.

    One place after the other is taken from random ones, with the most that it adds to what the poses tell of
    bias and weight of all sensors (greedy D-optimal design), less what the way to it costs.

    Args:
        robot: model of the machine.
        frames: of its sensors.
        start: where its joints are, (m,) [rad or m].
        limits: lower and upper, (m,) each; infinite ones are taken as a turn from the start.
        inside: whether the machine may be at a place (m,).
        count: of places.
        seed: of the random ones.

    Returns:
        Places (n, m), n = count or less where there is no way to more; the worst sensor's condition number.
    """
    best: tuple[Array, float] = np.zeros((0, len(start))), float("inf")
    for swing in SWINGS:
        rng = np.random.default_rng([seed, round(100 * swing)])
        places = _candidates(rng, start, limits, swing, inside)
        chosen = _greedy(robot, frames, start, places, inside, count)
        worst = _condition(robot, frames, chosen)
        if (len(chosen), -worst) > (len(best[0]), -best[1]):
            best = chosen, worst
        if len(chosen) == count and worst <= GOOD:
            break
    return best


def _candidates(
    rng: np.random.Generator,
    start: Array,
    limits: tuple[Array, Array],
    swing: float,
    inside: Callable[[Array], bool],
) -> Array:
    """Random places inside the limits, (n, m); each joint of each goes far or stays near by chance."""
    lower, upper = (
        np.where(np.isfinite(x), x, start + side * np.pi) for x, side in zip(limits, (-1, 1), strict=True)
    )
    far = swing * rng.uniform(0.0, 1.0, (DRAWN, len(start)))
    drawn = start + far * (rng.uniform(lower, upper, far.shape) - start)
    found = list(islice((q for q in drawn if inside(q)), CANDIDATES))
    return np.array(found).reshape(-1, len(start))


def directions(robot: Robot, frame: str, places: Array) -> Array:
    """Unit vectors along gravity in a frame, (n, 3)."""
    gravity = robot.model.gravity.linear / np.linalg.norm(robot.model.gravity.linear)
    rotations = np.array([robot.placement(q, frame)[:3, :3] for q in places]).reshape(-1, 3, 3)
    return gravity_at(rotations, gravity)


def _greedy(
    robot: Robot,
    frames: Sequence[str],
    start: Array,
    places: Array,
    inside: Callable[[Array], bool],
    count: int,
) -> Array:
    rows = [np.hstack([directions(robot, frame, places), np.ones((len(places), 1))]) for frame in frames]
    known = [1e-2 * np.eye(DIRECTIONS) for _ in frames]
    left, at, chosen = np.ones(len(places), bool), start, []
    for _ in range(count):
        score = -HASTE * np.abs(places - at).max(axis=1, initial=0.0)
        for row, own in zip(rows, known, strict=True):
            # log det of the information with the row, less without it; force rows are I and u per axis
            score += np.log1p(np.einsum("ni,ij,nj->n", row, np.linalg.inv(own), row))
        score[~left] = -np.inf
        taken = next((i for i in np.argsort(-score) if left[i] and _free(at, places[i], inside)), None)
        if taken is None:
            break
        chosen.append(at := places[taken])
        left[taken] = False
        for row, own in zip(rows, known, strict=True):
            own += np.outer(row[taken], row[taken])
    return np.array(chosen).reshape(-1, len(start))


def _free(a: Array, b: Array, inside: Callable[[Array], bool]) -> bool:
    """Whether the straight way between two places is inside the limits."""
    steps = int(np.ceil(np.abs(b - a).max() / STEP))
    return all(inside(a + (b - a) * k / steps) for k in range(1, steps))


def _condition(robot: Robot, frames: Sequence[str], places: Array) -> float:
    if not len(places):
        return float("inf")
    return max(condition(directions(robot, frame, places)) for frame in frames)
