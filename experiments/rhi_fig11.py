"""ContactAware, fig. 11: palpation without and with the transition between the desired ellipsoids."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from ..models import Array
from ..sim.hand import PointHand
from .outcome import Outcome, Progress, Row
from .palpation import RATE, Device, Palpation, Trace, simulate

TITLE = "palpation without and with transition (fig. 11)"
SWITCH = round(0.8 * RATE)
"""Tick of the switch with a hand that only rests on the handle."""
UNCAPPED = 1e3
LIGHT_HAND = (200.0, 4.0, 20.0)


def switched(rho: float, paper: bool) -> Trace:
    """A switch from free to stiff while a light hand holds the handle and nothing is rendered."""
    saturation: dict[str, Any] = {"rho": rho, "urgency": 1.0}
    null_space: dict[str, Any] = {"scan": 0, "cap": UNCAPPED, "ratio": 0.0} if paper else {}
    device = Device(saturation=saturation, null_space=null_space)
    controller, wall = device.controller()
    if paper:
        controller.space.slew = inf
    centre = device.centre - 0.02 * device.u
    hand = PointHand(Palpation((*centre, 0.0), (*device.u, 0.0), 0.0, 1.0), *LIGHT_HAND)
    device.centre = centre
    start = device.posture(False)

    def empty(k: int) -> None:
        """From the switch on the observer says that the tank is empty."""
        if k == SWITCH:
            controller.space.reserve = lambda J, steepness: 0.0  # type: ignore[method-assign]

    return simulate(controller, device.plant(start), hand, wall, 2.5, empty)


def excursion(trace: Trace) -> float:
    """How far the hand moves from where it is at the switch [m]."""
    return float(np.linalg.norm(trace.position - trace.position[SWITCH], axis=1).max())


def jump(trace: Trace) -> float:
    """Change of the null-space torque in the tick of the switch [N m]."""
    return float(np.linalg.norm(trace.null[SWITCH] - trace.null[SWITCH - 1]))


def run(progress: Progress) -> Outcome:
    """Jump of the null-space torque, motion of the hand, and the palpation of the figure."""
    rho = Device().config.rhi.saturation.rho
    rows, figures = [], {}
    for name, paper in (("the paper's law", True), ("capped, with posture targets", False)):
        progress(name)
        sudden, smooth = switched(0.0, paper), switched(rho, paper)
        jumps, moves = (jump(sudden), jump(smooth)), (excursion(sudden), excursion(smooth))
        rows.append(
            Row(
                f"jump of tau_N at the switch without / with, {name} [N m]",
                "discontinuous / smooth",
                f"{jumps[0]:.3f} / {jumps[1]:.1e}",
                f"{jumps[0] / jumps[1]:.0f} times smaller",
            )
        )
        rows.append(
            Row(
                f"hand moved by the switch without / with, {name} [mm]",
                "visible / not visible",
                f"{1e3 * moves[0]:.3f} / {1e3 * moves[1]:.3f}",
                f"{moves[1] / moves[0]:.2f} of it",
            )
        )
        figures[name] = {"jump_nm": jumps, "hand_m": moves}
    progress("palpation")
    traces = {
        "without transition": Device(saturation={"rho": 0.0}).palpate(0.02, 0.25, 4.0),
        "with transition": Device().palpate(0.02, 0.25, 4.0),
    }
    return Outcome(rows, figures, lambda figure: _draw(figure, traces), (9.0, 7.0))


def _draw(figure: Any, traces: dict[str, Trace]) -> None:
    axes = figure.subplots(3, 2, sharex=True, sharey="row")
    for k, (name, trace) in enumerate(traces.items()):
        force: Array = np.linalg.norm(trace.force, axis=1)
        axes[0, k].plot(trace.t, force, label="rendered")
        axes[0, k].plot(trace.t, np.linalg.norm(trace.demand, axis=1), lw=0.8, label="demand")
        axes[0, k].set_title(name)
        axes[1, k].plot(trace.t, trace.torque, label=[f"motor {i}" for i in range(1, 5)])
        axes[2, k].plot(trace.t, trace.reserve, label="reserve V")
        axes[2, k].plot(trace.t, trace.omega, label="activation of the free ellipsoid")
        axes[2, k].set_xlabel("t [s]")
    for row, label in enumerate(("force on the hand [N]", "motor torque [N m]", "share of 1")):
        axes[row, 0].set_ylabel(label)
        axes[row, 0].legend(fontsize=7)
