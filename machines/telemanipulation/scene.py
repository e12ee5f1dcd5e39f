"""A station as it is drawn: both of its arms, and where the other station has their palms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...runtime.core.scene import Box, Grip, Plane, Strength
from .arm import FLANGE, SIDES
from .sections import OwnChain, Station


class StationScene:
    """See ``MachineScene``."""

    boxes: tuple[Box, ...] = ()
    planes: tuple[Plane, ...] = ()
    strength: Strength | None = None

    def __init__(self, section: Station, wrench: str) -> None:
        """A station, and the field of its state that keeps the wrenches on the palms, in their axes."""
        self._wrench = wrench
        self._joints = [len(getattr(section.arms, side).lower) for side in SIDES]
        self.parts = tuple(getattr(section.arms, side).prefix for side in SIDES)
        self.grips = tuple(_grip(side, getattr(section.arms, side)) for side in SIDES)

    def posture(self, state: np.void) -> Sequence[float]:
        """Joints, left arm first."""
        return [x for q, n in zip(state["q"].tolist(), self._joints, strict=True) for x in q[:n]]

    def wrench(self, state: np.void) -> Sequence[float]:
        """Of the world on the palms."""
        wrenches: list[float] = state[self._wrench].ravel().tolist()
        return wrenches

    def twin(self, state: np.void) -> Sequence[float]:
        """Where the other station has the palms."""
        places: list[float] = state["goal"].ravel().tolist()
        return places


def _grip(side: str, chain: OwnChain) -> Grip:
    x, y, z = chain.palm
    a, b, c = chain.turned
    return Grip(side, f"{chain.prefix}{FLANGE}", (x, y, z), (a, b, c), own_axes=True)
