"""Seed 001, fig. 10: force along u over the workspace in the free, the stiff and the strongest posture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..control.manipulability import velocity_ellipsoid
from ..control.polytope import Polytope, cone, worst_force
from ..control.saturation import force_limit
from ..control.self_motion import CLOSED, Objective, close, descend
from ..models import Array
from .outcome import Outcome, Progress, Row
from .palpation import Device

TITLE = "force over the workspace (fig. 10)"
GRID, NEAR, FAR = 31, 0.05, 0.75
STARTS, BEST = 60, 6
CONE = np.radians(20.0)


def multistart(device: Device, x: Array, objective: Objective, seed: int) -> tuple[Array, NDArray[np.bool_]]:
    """The best of many local optima for each hand position (k, m): postures (k, n) and found (k,)."""
    k, n = len(x), device.arm.n
    start = np.random.default_rng(seed).uniform(-np.pi, np.pi, (k * STARTS, n))
    targets = np.repeat(x, STARTS, axis=0)
    q = close(device.arm, start, targets)
    position, J = device.arm.reach(q)
    cost = objective.cost(J)
    cost[np.linalg.norm(position - targets, axis=1) > CLOSED] = np.inf
    order = np.argsort(cost.reshape(k, STARTS), axis=1)[:, :BEST]
    chosen = (order + STARTS * np.arange(k)[:, None]).ravel()
    found, least = descend(device.arm, q[chosen], targets[chosen], objective, 150)
    least[np.isinf(cost[chosen])] = np.inf
    best = np.argmin(least.reshape(k, BEST), axis=1)
    reached = np.isfinite(least.reshape(k, BEST).min(axis=1))
    return found.reshape(k, BEST, n)[np.arange(k), best], reached


def run(progress: Progress) -> Outcome:
    """Optimise every point of the grid for both ellipsoids and for the robust polytope."""
    device = Device()
    axis = np.linspace(-FAR, FAR, GRID)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1)
    radius = np.linalg.norm(grid, axis=-1)
    inside = (NEAR < radius) & (radius < FAR)
    x, u = grid[inside], device.u
    directions = cone(u, CONE)
    progress(f"{len(x)} points, free")
    free, reached_free = multistart(device, x, device.desired(False), 1)
    progress(f"{len(x)} points, stiff")
    stiff, reached_stiff = multistart(device, x, device.desired(True), 2)
    good = reached_free & reached_stiff
    J_free, J_stiff = device.arm.reach(free)[1], device.arm.reach(stiff)[1]
    force = {"free": force_limit(J_free, device.limit, u), "stiff": force_limit(J_stiff, device.limit, u)}
    worst = {"stiff": worst_force(J_stiff, device.limit, directions)}
    values = np.linalg.eigvalsh(velocity_ellipsoid(J_stiff, device.limit))
    condition = values[:, -1] / values[:, 0]
    for name, aims in (("exact", u[None]), ("robust", directions)):
        progress(f"{len(x)} points, {name} polytope")
        strong = _strongest(device, stiff, x, condition, aims)
        J = device.arm.reach(strong)[1]
        force[name], worst[name] = force_limit(J, device.limit, u), worst_force(J, device.limit, directions)
    ratio = (force["stiff"] / force["free"])[good]
    gain = (force["exact"] / force["stiff"])[good]
    robust = (worst["robust"] / worst["stiff"])[good]
    share = float(np.mean(ratio > 1.0))
    rows = [
        Row("points of the 31 x 31 grid in reach", "-", f"{int(good.sum())} of {len(x)}"),
        Row("points where stiff renders more than free", "all", f"{100 * share:.1f} %"),
        Row("stiff over free, mean / median", "considerably larger", _pair(ratio)),
        Row("exact polytope over stiff ellipsoid, mean / largest", "-", _ends(gain), "at equal conditioning"),
        Row(
            "least force in a cone of +-20 degrees, robust polytope over ellipsoid, mean / least",
            "-",
            f"{robust.mean():.3f} / {robust.min():.3f}",
        ),
        Row(
            "the same, exact polytope over ellipsoid, mean / least",
            "-",
            f"{(worst['exact'] / worst['stiff'])[good].mean():.3f}"
            f" / {(worst['exact'] / worst['stiff'])[good].min():.3f}",
            "strong along u, fragile beside it",
        ),
    ]
    figures = {
        "points": int(good.sum()),
        "stiff_more": share,
        "ratio_mean": float(ratio.mean()),
        "ratio_median": float(np.median(ratio)),
        "polytope_mean": float(gain.mean()),
        "polytope_max": float(gain.max()),
        "robust_worst_mean": float(robust.mean()),
        "robust_worst_min": float(robust.min()),
    }

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 3, sharey=True)
        for a, name in zip(axes, ("free", "stiff", "robust"), strict=True):
            image = np.full(inside.shape, np.nan)
            image[inside] = np.where(good, np.minimum(force[name], 30.0), np.nan)
            mesh = a.pcolormesh(axis, axis, image, vmin=0.0, vmax=30.0, cmap="viridis", rasterized=True)
            a.set(title=f"{name}: force along u [N]", aspect="equal", xlabel="x [m]")
        figure.colorbar(mesh, ax=axes)

    return Outcome(rows, figures, draw, (10.0, 3.8))


def _strongest(device: Device, start: Array, x: Array, condition: Array, directions: Array) -> Array:
    """Stiff postures pulled to the polytope's optimum, each no worse conditioned than it was."""
    objective = Polytope(device.limit, directions, worst_condition=condition)
    found, _ = descend(device.arm, start, x, objective, 300)
    before = worst_force(device.arm.reach(start)[1], device.limit, directions)
    after = worst_force(device.arm.reach(found)[1], device.limit, directions)
    return np.asarray(np.where((after > before)[:, None], found, start))


def _pair(values: Array) -> str:
    return f"{values.mean():.2f} / {np.median(values):.2f}"


def _ends(values: Array) -> str:
    return f"{values.mean():.3f} / {values.max():.2f}"
