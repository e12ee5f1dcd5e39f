"""ContactAware, fig. 7: activation of the desired ellipsoids over a swing of the reserve."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..machines.rhi.transition import Thresholds, Transition
from .outcome import Outcome, Progress, Row
from .palpation import RATE, Device

TITLE = "activation and transition of the desired ellipsoids (fig. 7)"


def run(progress: Progress) -> Outcome:
    """Let the reserve fall and rise and follow the activation."""
    device = Device()
    uu = np.outer(device.u, device.u)
    apart = float(np.linalg.norm(device.shape.free(uu) - device.shape.stiff(uu)))
    duration = device.config.rhi.saturation.rho * apart
    saturation = device.config.rhi.saturation
    transition = Transition(Thresholds(saturation.leave, saturation.come_back), 1.0 / RATE)
    t = np.arange(0.0, 4.0, 1.0 / RATE)
    V = 0.75 + 0.25 * np.cos(2 * np.pi * t / 4.0)
    omega = np.array([transition.update(float(v), float(v), duration) for v in V])
    step = float(np.abs(np.diff(omega)).max())
    rows = [
        Row("K", "123", f"{device.shape.major:.1f}"),
        Row("zeta", "3.3", f"{device.shape.minor:.2f}"),
        Row("duration of a transition tf - t0 [s]", "0.5", f"{duration:.3f}"),
        Row("largest step of the activation in a tick", "-", f"{step:.4f}", "continuous"),
    ]

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        axes.plot(t, V, label="reserve V")
        axes.plot(t, omega, label="activation of the free ellipsoid")
        for limit, line, what in (
            (saturation.leave, ":", "leaves free"),
            (saturation.come_back, "-.", "returns"),
        ):
            axes.axhline(limit, color="0.4", lw=0.8, ls=line, label=f"V at which it {what}: {limit:g}")
        axes.set(xlabel="t [s]", ylabel="share of 1")
        axes.legend()

    figures = {"K": device.shape.major, "zeta": device.shape.minor, "duration_s": duration, "step": step}
    return Outcome(rows, figures, draw, (8.0, 3.2))
