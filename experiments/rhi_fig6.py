"""ContactAware, fig. 6: the actuator saturation observer of a 2-DoF robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..machines.rhi.saturation import reserve
from .outcome import Outcome, Progress, Row

TITLE = "actuator saturation observer (fig. 6)"
LIMIT = np.array([0.5, 2.0])
STEEPNESS = (1.0, 5.0)
LABEL = "reserve V"


def run(progress: Progress) -> Outcome:
    """Evaluate (14) over the torque box."""
    grid = np.stack(np.meshgrid(*(np.linspace(-most, most, 81) for most in LIMIT), indexing="ij"), axis=-1)
    surfaces = [reserve(grid, LIMIT, S) for S in STEEPNESS]
    edge = max(float(np.abs(V[[0, -1]]).max()) for V in surfaces)
    rows = [
        Row("V without torque", "1", f"{surfaces[0][40, 40]:g}"),
        Row("largest V on the border of the torque box", "0", f"{edge:.1e}"),
        Row("S", "not given", "1 and 5 drawn", "S = 5 stays flat for longer"),
    ]

    def draw(figure: Any) -> None:
        for k, (S, V) in enumerate(zip(STEEPNESS, surfaces, strict=True), 1):
            axes = figure.add_subplot(1, 2, k, projection="3d")
            surface = axes.plot_surface(
                grid[..., 0], grid[..., 1], V, cmap="viridis", rcount=27, ccount=27, rasterized=True
            )
            axes.set(title=f"S = {S:g}", xlabel="torque 1 [N m]", ylabel="torque 2 [N m]", zlabel=LABEL)
            axes.set(xticks=(-LIMIT[0], 0, LIMIT[0]), yticks=(-LIMIT[1], 0, LIMIT[1]))
            axes.set_box_aspect(None, zoom=0.75)  # or the label of z is cut off
        figure.colorbar(surface, ax=figure.axes, label=LABEL, shrink=0.6)

    return Outcome(rows, {"centre": float(surfaces[0][40, 40]), "border": edge}, draw, (9.0, 4.5))
