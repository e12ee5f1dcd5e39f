"""Contact that comes again and turns: taps that follow each other, and a hand that slides round a corner."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np

from ..configs.quantities import Damping, Lengths, Sizes, Stiffness, Thickness
from ..machines.rhi.config import RhiBox
from ..machines.rhi.saturation import force_limit
from ..machines.rhi.self_motion import scan
from ..models import Array
from ..sim.hand import Path, PointHand
from .outcome import Outcome, Progress, Row
from .palpation import HAND, RATE, Device, Trace, simulate

TITLE = "taps that follow each other, and a slide round a corner"
BOX = RhiBox(
    point=Lengths((0.45, 0.2)), size=Sizes((0.12, 0.2)), stiffness=Stiffness(1000.0), damping=Damping(2.0)
)
"""Its near side is y = 0.1 m, its right one x = 0.51 m."""
SPACING = Thickness(0.04)
"""Of the places that postures are found for [m]."""
SCAN = 1000
REACH = 300
"""Configurations scanned for what could be rendered at best."""
EVERY = 25
"""Ticks between two places for which that is asked."""
WORTH = 2.0
"""Least demand for which it is asked [N]."""
TAPS = 6
PERIODS = (0.2, 0.3, 0.5)
"""Of the taps [s]."""
DEPTH = 0.012
WAIT = 0.5
FRONT = (0.46, 0.09)
"""From where the taps go [m]."""
TIMES = (0.0, 0.5, 1.5, 3.5, 4.5, 5.5, 7.5)
WAY = ((0.47, 0.08), (0.47, 0.08), (0.47, 0.11), (0.50, 0.11), (0.502, 0.112), (0.50, 0.16), (0.50, 0.18))
"""Into the near side, along it, round the corner and along the right one [m]."""


OF_BOX = f"{1e3 * DEPTH:g} mm deep in 1000 N/m"


def box_device() -> Device:
    """The built-in interface, which renders a box instead of the wall."""
    device = Device(null_space={"spacing": SPACING, "scan": SCAN})
    rhi = msgspec.structs.replace(device.config.rhi, bodies={"box": BOX})
    device.config = msgspec.structs.replace(device.config, rhi=rhi)
    return device


def taps(period: float, count: int) -> tuple[list[float], list[tuple[float, float]]]:
    """Times [s] and places (2,) [m] of taps DEPTH deep; half of each period goes in, half out."""
    times, places = [0.0, WAIT], [FRONT, FRONT]
    for k in range(count):
        times += [WAIT + (k + 0.5) * period, WAIT + (k + 1.0) * period]
        places += [(FRONT[0], 0.1 + DEPTH), FRONT]
    return times, places


def touch(device: Device, times: Sequence[float], places: Sequence[Sequence[float]]) -> Trace:
    """A session along a path."""
    controller, rendered = device.controller()
    simulation = device.config.simulation
    assert simulation is not None
    hand = PointHand(Path(times, np.column_stack([places, np.zeros(len(places))])), *HAND)
    plant = device.plant(np.array(simulation.rhi.posture))
    return simulate(controller, plant, hand, rendered, times[-1])


def possible(device: Device, trace: Trace) -> Array:
    """The smaller of demand and static optimum of the hand's place, every EVERY ticks, (k,) [N].

    NaN where less than WORTH is asked for.
    """
    found = []
    for x, demand in zip(trace.position[::EVERY], trace.demand[::EVERY], strict=True):
        asked = float(np.linalg.norm(demand))
        best = np.nan
        if asked > WORTH:
            postures = scan(device.arm, x, device.bounds, REACH)
            J = device.arm.reach(postures)[1]
            best = min(asked, float(force_limit(J, device.limit, demand / asked).max(initial=0.0)))
        found.append(best)
    return np.array(found)


def run(progress: Progress) -> Outcome:
    """Taps of every period, and the slide."""
    device = box_device()
    rows: list[Row] = []
    figures: dict[str, Any] = {}
    traces: dict[str, tuple[Trace, Array]] = {}
    for period in PERIODS:
        name = f"taps every {period:g} s"
        progress(name)
        trace = touch(device, *taps(period, TAPS))
        bound = possible(device, trace)
        force = np.linalg.norm(trace.force[::EVERY], axis=1)
        ends = [round((WAIT + k * period) * RATE / EVERY) for k in range(TAPS + 1)]
        inside = [slice(*pair) for pair in pairwise(ends)]
        shares = [float(force[tap].max() / np.nanmax(bound[tap])) for tap in inside]
        quantity = f"peak of {name} over what is reachable, the first / least from the third on"
        rows.append(Row(quantity, "-", f"{shares[0]:.3f} / {min(shares[2:]):.3f}", OF_BOX))
        figures[name] = {"shares": shares}
        traces[name] = trace, bound
    progress("corner")
    trace = touch(device, TIMES, WAY)
    bound = possible(device, trace)
    force = np.linalg.norm(trace.force[::EVERY], axis=1)
    peak, mean = float(force.max() / np.nanmax(bound)), float(np.nanmean(force / bound))
    step = float((np.abs(np.diff(trace.torque, axis=0)) / device.limit).max())
    note = "what the hand got back is missing until it presses again"
    rows += [
        Row("slide round a corner: peak over what is reachable", "-", f"{peak:.3f}"),
        Row("slide round a corner: mean over what is reachable", "-", f"{mean:.3f}", note),
        Row("slide round a corner: step of a torque over its limit", "-", f"{step:.3f}", "tick to tick"),
    ]
    figures["corner"] = {"peak": peak, "mean": mean, "step": step}
    shown = {"taps every 0.3 s": traces["taps every 0.3 s"], "slide round a corner": (trace, bound)}
    return Outcome(rows, figures, lambda figure: _draw(figure, shown), (9.0, 3.6))


def _draw(figure: Any, traces: dict[str, tuple[Trace, Array]]) -> None:
    axes = figure.subplots(1, len(traces), sharey=True)
    for plot, (name, (trace, bound)) in zip(axes, traces.items(), strict=True):
        plot.plot(trace.t, np.linalg.norm(trace.demand, axis=1), lw=0.8, label="demand")
        plot.plot(trace.t[::EVERY], bound, "k.", ms=3, label="reachable of it")
        plot.plot(trace.t, np.linalg.norm(trace.force, axis=1), label="rendered")
        plot.set(title=name, xlabel="t [s]")
    axes[0].set_ylabel("force on the hand [N]")
    axes[0].legend(fontsize=7)
