"""What people see of a session of an operator's station."""

from __future__ import annotations

import numpy as np

from ...runtime.core.machine import FigureSpec
from ..telemanipulation.figures import StationFigures


class OperatorFigures(StationFigures):
    """Those of a station, and how many fingers the gloves hold."""

    specs = (*StationFigures.specs, FigureSpec("fingers held by brakes", ""))
    felt = "hand"

    def values(self, state: np.void) -> list[float]:
        """The figures of one record."""
        return [*super().values(state), float(sum(bits.bit_count() for bits in state["brakes"].tolist()))]
