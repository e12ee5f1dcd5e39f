"""Where to mount an operator arm so that it reaches what a person's hand reaches (Bimanual, V-A)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..control.panda_ik import PandaIk
from ..models import Array
from .moved_arm import PALM, panda
from .seated_operator import HandPoses

STEPS, COARSE = 90, 30
"""Of q7 for an answer, and within the search."""
SUBSET = 400
"""Poses of the search."""
FIRST, ROUNDS, PER_ROUND, ELITE = 160, 8, 40, 8
"""Mountings tried anywhere, then rounds about the best of them."""
LOWER = np.array([-0.6, 0.1, -0.6, -np.pi, -np.pi, -np.pi])
HIGHER = np.array([0.7, 0.9, 0.7, np.pi, np.pi, np.pi])
"""Places of the arm's base in the person's frame [m], and rotation vectors [rad]."""
BODY = 0.4
"""No base is closer to the person's upright axis, unless it is behind him [m]."""
BEHIND = -0.25

Mounting = tuple[float, ...]
"""Position and rotation vector of the base in the person's frame, 6 numbers [m, rad]."""
INITIAL: Mounting = (-0.25, 0.35, 0.0, -np.pi / 4, 0.0, 0.0)
"""As the avatar's arms: at the height of the shoulders, behind them, 70 cm apart, in a V of 45 degrees."""


def base(mounting: Mounting) -> Array:
    """Pose of the base, (4, 4)."""
    T: Array = pin.SE3(pin.exp3(np.array(mounting[3:])), np.array(mounting[:3])).homogeneous
    return T


@cache
def _ik() -> PandaIk:
    return PandaIk(panda(), PALM)


def reached(mounting: Mounting, poses: HandPoses, steps: int = STEPS) -> NDArray[np.bool_]:
    """Which poses the arm reaches from there with some q7, (k,)."""
    ik = _ik()
    ik.mount(base(mounting))
    return ik.reach(poses.positions, poses.rotations, steps)


def _share(work: tuple[Mounting, HandPoses, int]) -> float:
    return float(reached(*work).mean())


def possible(x: Array) -> bool:
    """Whether a base may stand there: not in the person, not in his lap."""
    return bool(x[0] < BEHIND or np.hypot(x[0], x[1]) > BODY)


@dataclass(frozen=True, slots=True)
class Progress:
    """Of a search.

    Attributes:
        done, of: mountings; best: share of the subset that the best of them reaches.
    """

    done: int
    of: int
    best: float


def search(
    poses: HandPoses, seed: int, pool: Executor | None, progress: Callable[[Progress], None]
) -> Mounting:
    """The best mounting that was found; the same for the same seed, whatever the pool.

    Some hundred are compared on a part of the poses, the best few of them on all.
    """
    random, subset = np.random.default_rng([seed, 5]), poses.part(min(SUBSET, len(poses.positions)))
    total = FIRST + ROUNDS * PER_ROUND + ELITE
    tried: list[tuple[float, Mounting]] = []

    def run(batch: Sequence[Mounting], on: HandPoses, steps: int) -> None:
        work = [(mounting, on, steps) for mounting in batch]
        shares = pool.map(_share, work, chunksize=2) if pool else map(_share, work)
        for share, mounting in zip(shares, batch, strict=True):
            tried.append((share, mounting))
            progress(Progress(len(tried), total, max(tried)[0]))

    run([INITIAL, *_draw(random, FIRST - 1, lambda: random.uniform(LOWER, HIGHER))], subset, COARSE)
    width = np.array([0.15, 0.15, 0.15, 0.5, 0.5, 0.5])
    for _ in range(ROUNDS):
        best = [np.array(mounting) for _, mounting in sorted(tried, reverse=True)[:ELITE]]
        run(_draw(random, PER_ROUND, _about(random, best, width)), subset, COARSE)
        width = 0.75 * width
    best_few = [mounting for _, mounting in sorted(tried, reverse=True)[:ELITE]]
    run(best_few, poses, STEPS)
    return max(tried[-ELITE:])[1]


def _about(random: np.random.Generator, best: Sequence[Array], width: Array) -> Callable[[], Array]:
    return lambda: best[int(random.integers(len(best)))] + width * random.standard_normal(6)


def _draw(random: np.random.Generator, count: int, one: Callable[[], Array]) -> list[Mounting]:
    found: list[Mounting] = []
    while len(found) < count:
        x = one()
        x[:3] = np.clip(x[:3], LOWER[:3], HIGHER[:3])
        if possible(x):
            found.append(tuple(x.tolist()))
    return found
