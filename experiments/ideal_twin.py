"""A free mass in a simulated hand without a machine around it, and how much of its way a handle goes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from ..machines.rendering.sections import CartesianTwin
from ..models import Array
from ..runtime.core.machine import LimitSpec
from ..runtime.core.modes import Mode
from ..runtime.core.sections import Config
from ..runtime.live.lockstep import Lockstep
from ..sim.hand import Hand, Path, PointHand

STEP_S = 1e-3
"""Period of its integration."""
SAMPLE_S = 20e-3
"""How far apart the places are between which a way is measured: what trembles goes no way."""
LEAST_M = 0.05
"""A hand that leads the free mass no further says nothing about a machine."""


@dataclass(frozen=True, slots=True)
class IdealTwin:
    """A free mass with damping, held at its centre, so that how it is turned does not move it.

    Attributes:
        mass, damping: of the twin [kg], [N s/m].
        hand: that leads it.
        lower, upper: of the handle's place, (3,) [m]; it stops there without a bounce.
    """

    mass: float
    damping: float
    hand: PointHand
    lower: Sequence[float] = (-inf, -inf, -inf)
    upper: Sequence[float] = (inf, inf, inf)

    def way(self, place: Sequence[float], begin: float, end: float) -> Array:
        """Places (k, 3) at every SAMPLE_S from begin to end [s], at rest in a place (3,) at first [m]."""
        x, v = [float(value) for value in place], [0.0, 0.0, 0.0]
        low, high = [*map(min, self.lower, x)], [*map(max, self.upper, x)]
        gain, kept, every = STEP_S / self.mass, 1.0 + STEP_S * self.damping / self.mass, _every(STEP_S)
        places = [tuple(x)]
        for k in range(round((end - begin) / STEP_S)):
            force = self.hand.force(begin + k * STEP_S, x, v)
            for i in range(3):
                v[i] = (v[i] + gain * force[i]) / kept
                x[i] += STEP_S * v[i]
                if not low[i] <= x[i] <= high[i]:
                    x[i], v[i] = min(max(x[i], low[i]), high[i]), 0.0
            if (k + 1) % every == 0:
                places.append(tuple(x))
        return np.array(places)


def ideal_twin(config: Config, limits: Sequence[LimitSpec]) -> IdealTwin | None:
    """That of a machine which renders a free mass first, within those of its limits that are the handle's.

    Tilt, joints and what else confines the machine do not confine it. None for other twins and machines.
    """
    twin = next(iter(getattr(config, "twins", {}).values()), None)
    if not isinstance(twin, CartesianTwin) or config.simulation is None:
        return None
    hand = config.simulation.hand
    path = Path([float(p.at) for p in hand.path], np.array([tuple(p.position) for p in hand.path]))
    ends = {spec.name: (spec.lower, spec.upper) for spec in limits}
    box = [ends.get(f"handle {axis}", (-inf, inf)) for axis in "xyz"]
    return IdealTwin(
        float(twin.mass),
        float(twin.damping),
        PointHand(path, float(hand.stiffness), float(hand.damping), float(hand.force)),
        *zip(*box, strict=True),
    )


def length(places: Array) -> float:
    """Of the way through places (k, 3) [m]."""
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


class Covered:
    """How much of the ideal twin's way the handle of a simulated machine goes, from ACTIVE on."""

    def __init__(self, lockstep: Lockstep) -> None:
        session, hand = lockstep.session, getattr(lockstep.plant, "hand", None)
        specs = session.system.limits(session.config).specs
        self._hand = hand if isinstance(hand, Hand) else None
        self._twin = ideal_twin(session.config, specs) if self._hand else None
        self._lockstep, self._cycle = lockstep, session.cycle
        self._period = 1.0 / session.config.loop.rate
        self._every = _every(self._period)
        self._ticks, self._begin = 0, 0.0
        self._places: list[Sequence[float]] = []

    def add(self) -> None:
        """Take a tick."""
        if self._hand is None or self._twin is None or self._cycle.mode is not Mode.ACTIVE:
            return
        if not self._places:
            self._begin = self._lockstep.plant.time - self._period
        if self._ticks % self._every == 0:
            self._places.append(self._hand.handle)
        self._ticks += 1

    def share(self, end: float, stopped: bool) -> float | None:
        """Of the ideal twin's way until the end of the session [s], at most 1: who stops covers no more.

        None where there is no such twin, and where the hand led it nowhere.
        """
        if self._twin is None:
            return None
        if not self._places:
            return 0.0 if stopped else None
        ideal = length(self._twin.way(self._places[0], self._begin, end))
        return min(1.0, length(np.array(self._places)) / ideal) if ideal >= LEAST_M else None


def _every(period: float) -> int:
    """Periods from one place to the next."""
    return max(1, round(SAMPLE_S / period))
