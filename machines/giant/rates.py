"""Whether the giant's controllers are slow enough for their rate."""

from __future__ import annotations

import numpy as np

from ..rendering.check import Found, check_control, check_gains, check_motors, check_times
from .config import GiantConfig


def check_rates(config: GiantConfig) -> Found:
    """Gains, time constants and horizons that one control period cannot follow."""
    giant, dt = config.giant, 1.0 / config.loop.rate
    tracking, ppu = giant.tracking, giant.ppu
    gains = np.array([tracking.p_gain, tracking.d_gain, tracking.stiffness]) / tracking.rotor_inertia
    motors = {f"giant.tracking.d_gain[{i}]": tuple(of) for i, of in enumerate(gains.T.tolist())}
    return (
        check_control("giant", giant.force_control, giant.twin, giant.twins, dt)
        + check_motors(motors, dt)
        + check_gains({"giant.ppu.gain": (0.0, ppu.gain)}, dt)
        + check_times({"giant.ppu.time_constant": ppu.time_constant}, dt)
    )
