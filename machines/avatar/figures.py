"""What people see of a session of an avatar."""

from __future__ import annotations

import numpy as np

from ...runtime.core.machine import FigureSpec
from ...runtime.core.modes import Mode
from ..telemanipulation.arm import SIDES
from ..telemanipulation.figures import StationFigures


class AvatarFigures(StationFigures):
    """Those of a station, and what its hands hold."""

    specs = (
        *StationFigures.specs,
        *(FigureSpec(f"drives of {side} grasp", "") for side in SIDES),
        FigureSpec("current of the hands", "A"),
    )

    def values(self, state: np.void) -> list[float]:
        """The figures of one record."""
        return [
            *super().values(state),
            *state["grasping"].tolist(),
            float(np.max(state["currents"], initial=0.0)),
        ]

    def live(self, mode: Mode, state: np.void) -> list[str]:
        """As a station's, and which hand holds something."""
        said = super().live(mode, state)
        if not said:
            return said
        grasps = [side for side, count in zip(SIDES, state["grasping"].tolist(), strict=True) if count]
        return [*said, f"grasps: {' and '.join(grasps)}"] if grasps else said
