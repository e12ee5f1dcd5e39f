"""Whether the giant's controllers are slow enough for their rate."""

from __future__ import annotations

import numpy as np

from ..sampling import controls
from .config import GiantConfig

Found = list[tuple[str, str, str]]


def check_rates(config: GiantConfig) -> Found:
    """Gains, time constants and horizons that one control period cannot follow."""
    giant, dt = config.giant, 1.0 / config.loop.rate
    twin, tracking, force, ppu = giant.twin, giant.tracking, giant.force_control, giant.ppu
    rotor = np.array(tracking.rotor_inertia)
    pairs = {
        "giant.tracking.d_gain": (max(tracking.p_gain / rotor), max(tracking.d_gain / rotor)),
        "giant.force_control.d_gain": (force.p_gain, force.d_gain),
        "giant.twin.damping": (0.0, twin.damping / twin.mass),
        "giant.twin.rotational_damping": (0.0, twin.rotational_damping / twin.inertia),
        "giant.ppu.gain": (0.0, ppu.gain),
    }
    fix = "lower the gains, or raise the rate"
    found = [
        (key, f"with its spring and its inertia it acts faster than one period of {dt:g} s", fix)
        for key, (stiffness, damping) in pairs.items()
        if not controls(stiffness, damping, dt)
    ]
    times = {
        "giant.force_control.viability_horizon": force.viability_horizon,
        "giant.force_control.point_horizon": force.point_horizon,
        "giant.ppu.time_constant": ppu.time_constant,
    }
    found += [
        (key, f"{time:g} s is less than one period of {dt:g} s", "give at least a period")
        for key, time in times.items()
        if time < dt
    ]
    return found
