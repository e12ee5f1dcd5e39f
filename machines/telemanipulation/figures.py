"""What people see of a session of a station."""

from __future__ import annotations

from math import dist, hypot

import numpy as np

from ...control.lease import Standing
from ...runtime.core.machine import FigureSpec
from ...runtime.core.modes import Mode
from .arm import SIDES

WORDS = {
    Standing.IDLE: "not led",
    Standing.FOLLOWS: "linked",
    Standing.RESTS: "rests",
    Standing.WAITS: "link late",
    Standing.SILENT: "link silent",
    Standing.ENDED: "lease ended",
    Standing.BARRED: "stopped",
}
STANDINGS = tuple(Standing)


class StationFigures:
    """Forces, the link's age, and how far the palms are from where they are to be; see ``MachineFigures``."""

    specs: tuple[FigureSpec, ...] = (
        FigureSpec("force at the left palm", "N"),
        FigureSpec("force at the right palm", "N"),
        FigureSpec("palm to goal", "mm"),
        FigureSpec("age of what was heard", "ms"),
    )

    felt = "wrench"
    """Field of what acts on the palms."""

    def values(self, state: np.void) -> list[float]:
        """The figures of one record."""
        apart = max(map(dist, state["position"].tolist(), state["goal"].tolist()))
        return [*self._forces(state), 1e3 * apart, 1e3 * max(state["age"].tolist())]

    def live(self, mode: Mode, state: np.void) -> list[str]:
        """What each arm has to do with its peer, and what its palm feels."""
        if mode not in (Mode.ENGAGING, Mode.ACTIVE):
            return []
        forces = self._forces(state)
        rows = zip(SIDES, forces, state["standing"].tolist(), state["stopped"].tolist(), strict=True)
        return [
            f"{side} {'stopped' if stopped else WORDS[STANDINGS[standing]]} {force:.0f} N"
            for side, force, standing, stopped in rows
        ]

    def _forces(self, state: np.void) -> list[float]:
        return [hypot(*wrench[:3]) for wrench in state[self.felt].tolist()]
