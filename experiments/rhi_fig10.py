"""ContactAware, fig. 10: force along u over the workspace in free, stiff and strongest postures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..machines.rhi.manipulability import velocity_ellipsoid
from ..machines.rhi.polytope import Polytope, cone, worst_force
from ..machines.rhi.saturation import force_limit
from ..machines.rhi.self_motion import CLOSED, Objective, close, descend
from ..models import Array
from .outcome import Outcome, Progress, Row
from .palpation import Device

TITLE = "force over the workspace (fig. 10)"
GRID, NEAR, FAR = 31, 0.05, 0.75
STARTS, BEST = 60, 6
CONE = np.radians(20.0)
SHOWN = 30.0
"""Largest force that the plot tells apart [N]."""


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


@dataclass(frozen=True, slots=True)
class Field:
    """Forces over the workspace, at the k points of the grid between NEAR and FAR.

    Attributes:
        inside: which points of the grid they are (GRID, GRID).
        good: whether both ellipsoids' postures reach them (k,).
        force: along u [N] in the postures ``free``, ``stiff``, ``exact`` and ``robust`` (k,).
        worst: least force [N] in a cone around u in the last three (k,).
    """

    inside: NDArray[np.bool_]
    good: NDArray[np.bool_]
    force: dict[str, Array]
    worst: dict[str, Array]


def run(progress: Progress) -> Outcome:
    """Optimise every point of the grid for both ellipsoids and for both polytopes."""
    axis = np.linspace(-FAR, FAR, GRID)
    field = _optimise(axis, progress)
    good, force, worst = field.good, field.force, field.worst
    ratio = (force["stiff"] / force["free"])[good]
    gain = (force["exact"] / force["stiff"])[good]
    robust, fragile = ((worst[name] / worst["stiff"])[good] for name in ("robust", "exact"))
    share = float(np.mean(ratio > 1.0))
    rows = [
        Row("points of the 31 x 31 grid in reach", "-", f"{int(good.sum())} of {len(good)}"),
        Row("points where stiff renders more than free", "all", f"{100 * share:.1f} %"),
        Row(
            "stiff over free, mean / median",
            "considerably larger",
            f"{ratio.mean():.2f} / {np.median(ratio):.2f}",
        ),
        Row(
            "exact polytope over stiff ellipsoid, mean / largest",
            "-",
            f"{gain.mean():.3f} / {gain.max():.2f}",
            "at equal conditioning",
        ),
        Row(
            "least force in a cone of +-20 degrees, robust polytope over ellipsoid, mean / least",
            "-",
            _mean_least(robust),
        ),
        Row(
            "the same, exact polytope over ellipsoid, mean / least",
            "-",
            _mean_least(fragile),
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
    return Outcome(rows, figures, lambda figure: _draw(figure, axis, field), (10.0, 3.8))


def _optimise(axis: Array, progress: Progress) -> Field:
    device = Device()
    grid = np.stack(np.meshgrid(axis, axis), axis=-1)
    radius = np.linalg.norm(grid, axis=-1)
    inside = (NEAR < radius) & (radius < FAR)
    x, u = grid[inside], device.u
    directions = cone(u, CONE)
    progress(f"{len(x)} points, free")
    free, reached_free = multistart(device, x, device.desired(False), 1)
    progress(f"{len(x)} points, stiff")
    stiff, reached_stiff = multistart(device, x, device.desired(True), 2)
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
    return Field(inside, reached_free & reached_stiff, force, worst)


def _strongest(device: Device, start: Array, x: Array, condition: Array, directions: Array) -> Array:
    """Stiff postures pulled to the polytope's optimum, each no worse conditioned than it was."""
    objective = Polytope(device.limit, directions, worst_condition=condition)
    found, _ = descend(device.arm, start, x, objective, 300)
    before = worst_force(device.arm.reach(start)[1], device.limit, directions)
    after = worst_force(device.arm.reach(found)[1], device.limit, directions)
    return np.asarray(np.where((after > before)[:, None], found, start))


def _mean_least(values: Array) -> str:
    return f"{values.mean():.3f} / {values.min():.3f}"


def _draw(figure: Any, axis: Array, field: Field) -> None:
    axes = figure.subplots(1, 3, sharey=True)
    for a, name in zip(axes, ("free", "stiff", "robust"), strict=True):
        image = np.full(field.inside.shape, np.nan)
        image[field.inside] = np.where(field.good, field.force[name], np.nan)
        mesh = a.pcolormesh(axis, axis, image, vmin=0.0, vmax=SHOWN, cmap="viridis", rasterized=True)
        a.set(title=name, aspect="equal", xlabel="x [m]")
    axes[0].set_ylabel("y [m]")
    figure.colorbar(mesh, ax=axes, label="force along u [N]", extend="max")
