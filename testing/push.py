"""A constant push on what a hand may hold."""

from __future__ import annotations

import numpy as np

from ..models import Array
from ..sim.hold import Hold

FAR = 1e9
"""So far away does it want to go [m, rad]: it will not get weaker on the way."""


def push(hold: Hold, wrench: Array) -> None:
    """From now on the hold gives this wrench, (rows,) [N, N m], however what it holds moves."""
    for part, half in enumerate(np.split(np.asarray(wrench, float), hold.rows // 3)):
        strength = float(np.linalg.norm(half))
        hold.strength[part] = strength
        hold.stiffness[part], hold.damping[part] = 2.0 * strength / FAR, 0.0
        hold.error[3 * part : 3 * part + 3] = half * (FAR / strength if strength else 0.0)
    hold.rate[:] = 0.0
