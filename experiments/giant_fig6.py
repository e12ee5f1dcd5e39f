"""HapticGiant, Fig. 6: a walk through every limit of the machine with a free mass as the twin."""

from __future__ import annotations

from dataclasses import dataclass
from math import tau
from typing import Any

import numpy as np

from ..machines.giant.limits import GiantLimits
from ..models import Array
from ..runtime.configuration import config
from ..runtime.configuration.session import build
from ..runtime.live.lockstep import Lockstep, unswept
from .outcome import COLOURS, LINES, Outcome, Progress, Row
from .rendered import DRAWN, MOVED, seen

TITLE = "a walk through all limits, with a free mass as the twin"
SECONDS = 30.0
NEAR, NEAR_M = 2e-3, 2e-3
"""Measured values this close to a limit are there [rad], [m]."""
MOVING = 0.02
"""The gantry moves when it is faster [m/s]."""
WHILE_S = 0.6
"""For so long before and after a moment the hand's force is compared."""


@dataclass(frozen=True, slots=True)
class Walk:
    """What became of k ticks in which the twin was rendered.

    Attributes:
        t: (k,) [s].
        values: of everything that has a limit, by its name, (k,) each [rad or m].
        limits: lower and upper, by the same names.
        force, torque: of the hand as the controller has it, sizes, (k,) [N], [N m].
        gantry: velocity, (k, 2) [m/s].
        stop: why the session stopped, "" where it did not.
    """

    t: Array
    values: dict[str, Array]
    limits: dict[str, tuple[float, float]]
    force: Array
    torque: Array
    gantry: Array
    stop: str

    def low(self, name: str, near: float) -> Any:
        """Whether a value is at its lower limit, (k,)."""
        return self.values[name] <= self.limits[name][0] + near

    def high(self, name: str, near: float) -> Any:
        """Whether it is at its upper limit, (k,)."""
        return self.values[name] >= self.limits[name][1] - near

    def excess(self, name: str) -> float:
        """How far beyond its limits it went [rad or m]; negative inside."""
        lower, upper = self.limits[name]
        return float(max((lower - self.values[name]).max(), (self.values[name] - upper).max()))


def walk(seconds: float, progress: Progress) -> Walk:
    """The giant's default session in lockstep."""
    lockstep = Lockstep(build(config.load("giant")))
    session = lockstep.session
    cycle, rate = session.cycle, session.config.loop.rate
    limits = session.system.limits(session.config)
    assert isinstance(limits, GiantLimits)
    record = np.zeros(1, cycle.machine.state)
    cycle.machine.bind_state(record)
    state = record[0]
    rows: list[list[float]] = []
    with unswept():
        for tick in range(round(seconds * rate)):
            lockstep.tick()
            if cycle.mode in MOVED:
                cycle.machine.fill()
                hand = state["wrench"]
                sizes = [float(np.linalg.norm(part)) for part in (hand[:3], hand[3:])]
                rows.append([tick / rate, *limits.values(state), *sizes, *state["ppu"][1].tolist()])
            if tick % 5000 == 0:
                progress(f"{tick / rate:.0f} of {seconds:g} s")
    table = np.array(rows)
    names = [spec.name for spec in limits.specs]
    values = {name: table[:, 1 + i] for i, name in enumerate(names)}
    ends = {spec.name: (spec.lower, spec.upper) for spec in limits.specs}
    trip = cycle.stops.last
    stop = str(trip.verdict.detail) if trip else ""
    return Walk(table[:, 0], values, ends, table[:, -4], table[:, -3], table[:, -2:], stop)


def moments(w: Walk) -> dict[str, float | None]:
    """When what the paper tells of t_a to t_g happens, each after the one before [s]; None: it does not."""
    turned = np.abs(w.values["joint 1"] - w.values["joint 1"][0]) >= tau
    return seen(
        w.t,
        {
            "t_a": turned,
            "t_b": w.high("elbow x", NEAR_M) | w.low("elbow x", NEAR_M),
            "t_c": w.low("tilt (singularity)", NEAR),
            "t_d": w.low("joint 6", NEAR),
            "t_e": w.high("joint 4", NEAR),
            "t_f": w.high("PPU y", NEAR_M)
            & (np.abs(w.gantry[:, 1]) < MOVING)
            & (np.abs(w.gantry[:, 0]) > MOVING),
            "t_g": w.high("joint 2", NEAR),
        },
    )


def before_and_after(w: Walk, values: Array, moment: float | None) -> tuple[float, float]:
    """Mean before a moment and largest after it."""
    if moment is None:
        return float("nan"), float("nan")
    before = (w.t >= moment - WHILE_S) & (w.t < moment - WHILE_S / 2)
    after = (w.t >= moment) & (w.t < moment + WHILE_S)
    return float(values[before].mean()), float(values[after].max())


def run(progress: Progress) -> Outcome:
    """The default session, with the hand of its file."""
    w = walk(SECONDS, progress)
    found = moments(w)
    times = ", ".join(f"{name} {'-' if t is None else f'{t:.2f}'}" for name, t in found.items())
    handle = next((t for t in w.t[w.high("handle x", NEAR_M)] if t > (found["t_b"] or np.inf)), None)
    compared = {
        name: before_and_after(w, w.torque if name == "t_c" else w.force, found[name])
        for name in ("t_b", "t_c", "t_e", "t_g")
    }
    still = _while(w, found["t_f"])
    worst = {name: w.excess(name) for name in w.values}
    rows = [
        Row(
            "t_a to t_g, in this order [s]",
            "t_a, t_b, t_c, t_d, t_e, t_f, t_g",
            times,
            "simulated; found by what the text tells of each; our hand is a script",
        ),
        Row(
            "t_b: elbow at its box; excess [mm] / force before, most after [N]",
            "inhibited, rising force",
            f"{1e3 * worst['elbow x']:.2f} / {_pair(compared['t_b'])}",
            "" if handle is None else f"the handle follows at {handle:.2f} s",
        ),
        Row(
            "t_c: tilt at the singularity's limit; excess [mrad] / torque before, most after [N m]",
            "not exceeded, increase of torque",
            f"{1e3 * worst['tilt (singularity)']:.2f} / {_pair(compared['t_c'])}",
            "",
        ),
        Row(
            "t_d: joint 6 at its lower limit; excess [mrad]",
            "maintained",
            f"{1e3 * worst['joint 6']:.2f}",
            "",
        ),
        Row(
            "t_e: joint 4 at its upper limit; excess [mrad] / force before, most after [N]",
            "sudden jump",
            f"{1e3 * worst['joint 4']:.2f} / {_pair(compared['t_e'])}",
            "",
        ),
        Row(
            "t_f: PPU stands along y; it moves on along x by [mm] / force, mean [N]",
            "possible, force remains low",
            still,
            f"within {WHILE_S:g} s",
        ),
        Row(
            "t_g: joint 2 at its upper limit; excess [mrad] / force before, most after [N]",
            "increasing force",
            f"{1e3 * worst['joint 2']:.2f} / {_pair(compared['t_g'])}",
            "",
        ),
        Row(
            "worst excess of all limits, measured link side [mrad or mm]",
            "-",
            f"{1e3 * max(worst.values()):.2f}",
            max(worst, key=lambda name: worst[name]),
        ),
        Row("stops of the machine", "-", w.stop or "none", ""),
    ]
    figures = {"moments": found, "compared": compared, "worst": max(worst.values()), "stop": w.stop}
    return Outcome(rows, figures, lambda figure: _draw(figure, w, found), (8.0, 10.0))


def _pair(values: tuple[float, float]) -> str:
    return "{:.1f}, {:.1f}".format(*values)


def _while(w: Walk, moment: float | None) -> str:
    if moment is None:
        return "-"
    part = (w.t >= moment) & (w.t < moment + WHILE_S)
    return f"{1e3 * np.ptp(w.values['PPU x'][part]):.0f} / {w.force[part].mean():.1f}"


PANELS = (
    ("joint [rad]", ("joint 1", "joint 2", "joint 3")),
    ("joint, tilt [rad]", ("joint 4", "joint 5", "joint 6", "tilt (singularity)")),
    ("along x [m]", ("handle x", "elbow x", "PPU x")),
    ("along y [m]", ("handle y", "elbow y", "PPU y")),
)


def _draw(figure: Any, w: Walk, found: dict[str, float | None]) -> None:
    plots = figure.subplots(len(PANELS) + 1, 1, sharex=True)
    t = w.t[::DRAWN]
    for axes, (label, names) in zip(plots, PANELS, strict=False):
        for name, colour, line in zip(names, COLOURS, LINES, strict=False):
            axes.plot(t, w.values[name][::DRAWN], color=colour, ls=line, lw=1.0, label=name)
            for limit in w.limits[name]:
                if np.isfinite(limit):
                    axes.axhline(limit, color=colour, ls=":", lw=0.7)
        axes.set(ylabel=label)
        axes.legend(fontsize=6, ncols=3, loc="upper left")
    last = plots[-1]
    last.plot(t, w.force[::DRAWN], color=COLOURS[0], ls="-", lw=1.0, label="force [N]")
    last.plot(t, 10.0 * w.torque[::DRAWN], color=COLOURS[1], ls="--", lw=1.0, label="torque [0.1 N m]")
    last.set(xlabel="time [s]", ylabel="of the hand")
    last.legend(fontsize=6)
    for name, moment in found.items():
        if moment is None:
            continue
        for axes in plots:
            axes.axvline(moment, color="black", lw=0.7)
        plots[0].annotate(
            f"${name}$", (moment, 1.02), xycoords=("data", "axes fraction"), ha="center", va="bottom"
        )
