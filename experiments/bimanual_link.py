"""Over which networks a press on a wall is stable, with the passivity layer and without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ..models import Array
from .contact_over_link import Network, Press, Verdict, judge, press
from .outcome import Outcome, Progress, Row

TITLE = "contact over a network: delay and loss against stability, in simulation"
DELAYS = (0.0, 0.03, 0.06, 0.12, 0.35, 0.7)
"""Round trips [s]; what a packet takes varies by a third of it."""
LOSSES = (0.0, 0.05, 0.2)
"""Shares of the packets that are lost, either way."""
MANY_DELAYS = (0.0, 0.015, 0.03, 0.06, 0.09, 0.12, 0.2, 0.35, 0.5, 0.7, 1.0)
MANY_LOSSES = (0.0, 0.01, 0.05, 0.1, 0.2, 0.3)
"""The same of a study."""
VARIES = 1.0 / 3.0
CASE = replace(Press(3000.0), period=10.0)
"""A hand of 300 N/m presses on a wall of 3 kN/m, for once."""
STILL = 1e-3
"""How far a hand that rests in contact sways at most where it is stable [m]."""
LAYERS = {"with the layer": True, "without it": False}

Map = list[list[Verdict]]
"""By delay, then by loss."""


def run(progress: Progress) -> Outcome:
    """A coarse map."""
    return outcome(DELAYS, LOSSES, progress)


def study(progress: Progress) -> Outcome:
    """A finer one."""
    return outcome(MANY_DELAYS, MANY_LOSSES, progress)


def pressed_over(delay: float, loss: float, layer: bool) -> Verdict:
    """What becomes of the press over a round trip of so long [s] that loses such a share of the packets."""
    network = Network(0.5 * delay, 0.5 * VARIES * delay, loss)
    return judge(CASE, press(CASE, network, network, CASE.period, 1, layer))


def stable(verdict: Verdict) -> bool:
    """Whether the hand stood still in contact, and the wall was felt."""
    return verdict.swing < STILL and verdict.pressed > 0.0


def outcome(delays: Sequence[float], losses: Sequence[float], progress: Progress) -> Outcome:
    """Rows and plot of the maps."""
    maps: dict[str, Map] = {}
    for name, layer in LAYERS.items():
        maps[name] = []
        for delay in delays:
            progress(f"{name}, {1e3 * delay:g} ms")
            maps[name].append([pressed_over(delay, loss, layer) for loss in losses])
    kept, bare = maps.values()
    cells = [verdict for row in kept for verdict in row]
    longest = _longest(delays, bare)
    rows = [
        Row(f"stable, {name}", "-", f"{_stable(each)} of {len(cells)} networks")
        for name, each in maps.items()
    ]
    rows += [
        Row(
            "longest round trip without the layer that no loss makes unstable [ms]",
            "-",
            longest,
            "the avatar's impedance follows 0.18 s late by itself",
        ),
        Row("largest force with the layer [N]", "-", f"{max(each.force for each in cells):.1f}"),
        Row("least share of the avatar's force that is felt with it", "-", f"{_least_share(cells):.2f}"),
        Row(
            "most given out with it beyond what went in [J]",
            "-",
            f"{max(each.given for each in cells):.3f}",
            f"round trips to {1e3 * max(delays):g} ms, varying by a third, losses to {100 * max(losses):g} %",
        ),
    ]
    figures = {
        "delay_s": list(delays),
        "loss": list(losses),
        "maps": {name: [[asdict(cell) for cell in row] for row in each] for name, each in maps.items()},
    }

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 2, sharey=True)
        for at, (name, each) in zip(axes, maps.items(), strict=True):
            image = _draw(at, each, delays, losses)
            at.set(title=name, xlabel="round trip [ms]")
        axes[0].set_ylabel("packets lost [%]")
        figure.colorbar(image, ax=list(axes), label="sway of a hand at rest in contact [mm]")

    return Outcome(rows, figures, draw, (9.0, 3.6))


def _stable(each: Map) -> int:
    return sum(stable(verdict) for row in each for verdict in row)


def _longest(delays: Sequence[float], each: Map) -> str:
    """Round trip [ms] up to which all is stable."""
    found = "none"
    for delay, row in zip(delays, each, strict=True):
        if not all(map(stable, row)):
            break
        found = f"{1e3 * delay:g}"
    return found


def _least_share(cells: Sequence[Verdict]) -> float:
    return min((verdict.share for verdict in cells if stable(verdict)), default=0.0)


def _draw(axes: Any, each: Map, delays: Sequence[float], losses: Sequence[float]) -> Any:
    from matplotlib.colors import LogNorm

    sway: Array = np.array([[1e3 * verdict.swing for verdict in row] for row in each]).T
    image = axes.imshow(
        np.clip(sway, 1e-3, 1e3), norm=LogNorm(1e-3, 1e3), origin="lower", aspect="auto", cmap="RdYlGn_r"
    )
    for (row, column), value in np.ndenumerate(sway):
        axes.text(column, row, f"{value:.1g}", ha="center", va="center", fontsize=7)
    axes.set_xticks(range(len(delays)), [f"{1e3 * delay:g}" for delay in delays])
    axes.set_yticks(range(len(losses)), [f"{100 * loss:g}" for loss in losses])
    return image
