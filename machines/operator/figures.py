"""What people see of a session of an operator's station."""

from __future__ import annotations

import numpy as np

from ...control.cue import AVATAR_LIMIT, ENERGY, LIMIT, STOPPED, UNLED
from ...runtime.core.machine import FigureSpec
from ...runtime.core.modes import Mode
from ..telemanipulation.figures import StationFigures

INTERVENES = {
    LIMIT: "own limit {:.1f} N m",
    AVATAR_LIMIT: "avatar's limit {:.1f} N m",
    ENERGY: "link's energy {:.0f} N s/m",
    UNLED: "does not follow, {:.1f} s old",
    STOPPED: "avatar's arm stopped itself",
}
"""What keeps an arm from following, and how much."""


class OperatorFigures(StationFigures):
    """Those of a station, and how many fingers the gloves hold."""

    specs = (*StationFigures.specs, FigureSpec("fingers held by brakes", ""))
    felt = "hand"

    def values(self, state: np.void) -> list[float]:
        """The figures of one record."""
        return [*super().values(state), float(sum(bits.bit_count() for bits in state["brakes"].tolist()))]

    def live(self, mode: Mode, state: np.void) -> list[str]:
        """What each arm has to do with its peer, what its palm feels, and what intervenes."""
        found = super().live(mode, state)
        for i, (row, cause) in enumerate(zip(found, state["cause"].tolist(), strict=False)):
            if cause:
                found[i] = f"{row} ({INTERVENES[cause].format(float(state['amount'][i]))})"
        return found
