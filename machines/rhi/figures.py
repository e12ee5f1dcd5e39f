"""What people see of a session of a redundant interface."""

from __future__ import annotations

from math import hypot

import numpy as np

from ...runtime.core.machine import FigureSpec
from ...runtime.core.modes import Mode


class RhiFigures:
    """Work of the solver, depth in the wall and motors' reserve; see ``MachineFigures``."""

    specs: tuple[FigureSpec, ...] = (
        FigureSpec("HQP iterations", ""),
        FigureSpec("HQP solves", ""),
        FigureSpec("depth in the wall", "mm"),
    )

    def values(self, state: np.void) -> list[float]:
        """The figures of one record of the machine's state."""
        return [float(state["iterations"]), float(state["solves"]), max(0.0, 1e3 * float(state["depth"]))]

    def live(self, mode: Mode, state: np.void) -> list[str]:
        """Force of the hand; while the wall is rendered, how deep the hand is in it."""
        words = [f"force {hypot(*state['hand'][:3].tolist()):.0f} N"]
        if mode in (Mode.ENGAGING, Mode.ACTIVE) and state["depth"] > 0.0:
            words.append(f"wall {1e3 * float(state['depth']):.0f} mm")
        return words
