"""What people see of a session of a machine that renders a twin."""

from __future__ import annotations

from math import hypot

import numpy as np

from ...runtime.core.machine import FigureSpec
from ...runtime.core.modes import Mode


class RenderingFigures:
    """Work of the solver, and how far handle and twin are apart; see ``MachineFigures``."""

    specs: tuple[FigureSpec, ...] = (
        FigureSpec("HQP iterations", ""),
        FigureSpec("HQP solves", ""),
        FigureSpec("handle to twin", "mm"),
        FigureSpec("handle to twin, turned", "mrad"),
    )

    def values(self, state: np.void) -> list[float]:
        """The figures of one record of STATE."""
        error = state["coupling"].tolist()
        apart = 1e3 * hypot(*error[:3]), 1e3 * hypot(*error[3:])
        return [float(state["iterations"]), float(state["solves"]), *apart]

    def live(self, mode: Mode, state: np.void) -> list[str]:
        """The operator's force, which is estimated only while it moves the machine, and what yields to it."""
        if mode not in (Mode.ENGAGING, Mode.ACTIVE):
            return []
        words = [f"force {hypot(*state['wrench'][:3].tolist()):.0f} N"]
        spent = np.flatnonzero(state["spent"])
        return [*words, f"joint {spent[0] + 1} at its rated torque"] if spent.size else words
