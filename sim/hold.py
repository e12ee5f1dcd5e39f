"""What a hand does to what it holds: spring and damper, of limited strength, that move with it."""

from __future__ import annotations

import numpy as np


class Hold:
    """A grip as the dynamics integrate it, together with what is held: it is stable however stiff it is.

    It begins open.

    Attributes:
        rows: 3 where a point is held, 6 for a frame.
        stiffness, damping, strength: of translation and rotation, (2,); without strength nothing is held.
        error: from what is held to where the hand wants it: translation, rotation vector, (rows,) in B.
        rate: at which that place moves as seen from the arm's base, (rows,).
        wrench: what the hand did in the last step, (rows,) in B [N, N m].
    """

    def __init__(self, rows: int = 6) -> None:
        self.rows = rows
        self.stiffness, self.damping, self.strength = np.ones(2), np.ones(2), np.zeros(2)
        self.error, self.rate, self.wrench = np.zeros(rows), np.zeros(rows), np.zeros(rows)
