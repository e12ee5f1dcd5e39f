"""Whether the giant's controllers are slow enough for their rate."""

from __future__ import annotations

import numpy as np

from ..rendering.check import Found, check_control, check_gains, check_times
from .config import GiantConfig


def check_rates(config: GiantConfig) -> Found:
    """Gains, time constants and horizons that one control period cannot follow."""
    giant, dt = config.giant, 1.0 / config.loop.rate
    tracking, ppu = giant.tracking, giant.ppu
    rotor = np.array(tracking.rotor_inertia)
    pairs = {
        "giant.tracking.d_gain": (max(tracking.p_gain / rotor), max(tracking.d_gain / rotor)),
        "giant.ppu.gain": (0.0, ppu.gain),
    }
    return (
        check_control("giant", giant.force_control, giant.twin, giant.twins, dt)
        + check_gains(pairs, dt)
        + check_times({"giant.ppu.time_constant": ppu.time_constant}, dt)
    )
