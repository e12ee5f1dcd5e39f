"""What a session of a station may touch."""

from __future__ import annotations

import numpy as np

from ...runtime.core.machine import LimitSpec
from .arm import SIDES
from .sections import OwnChain, Station


class StationLimits:
    """The joints of both arms, and their measured values in a logged state."""

    def __init__(self, station: Station) -> None:
        chains: list[OwnChain] = [getattr(station.arms, side) for side in SIDES]
        self.specs = tuple(
            LimitSpec(f"{side} joint {i + 1}", low, high, "rad")
            for side, chain in zip(SIDES, chains, strict=True)
            for i, (low, high) in enumerate(zip(chain.lower, chain.upper, strict=True))
        )

    def values(self, state: np.void) -> list[float]:
        """Measured values in the order of ``specs``, from a record of its state."""
        values: list[float] = state["q"].reshape(-1).tolist()
        return values
