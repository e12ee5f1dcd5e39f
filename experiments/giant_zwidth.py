"""Beyond the paper: the highest wall that the giant renders without trembling, against the mass behind it.

A wall is a spring under the rendered mass, straight down. The hand taps it, stays pressed into it, and never
leaves it: the spring might as well be one-sided. Whether that is stable is told by what the hand of the
simulated machine gets at the handle, and by nothing that the controller counts. The machine is what its
controller believes, without dry friction, which would swallow what trembles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import msgspec
import numpy as np

from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from . import haptify
from .haptify import Felt, Place, Way
from .outcome import COLOURS, LINES, Outcome, Progress, Row
from .own_plant import Doubt, believed

TITLE = "Z-width of the giant: highest stable wall against the rendered mass"
WALLS = (1e3, 2e3, 4e3, 8e3, 16e3, 32e3, 64e3)
"""Stiffnesses of walls [N/m]."""
MASSES, JUDGED = (1.0, 2.0, 4.0, 8.0), (1.0, 4.0)
"""What is rendered, and what of it is tried with the passivity layer on a wall beyond the limit [kg]."""
STIFF, SOFTLY_DAMPED, DAMPED = (300.0, 900.0, 3000.0), (10.0,), (10.0, 40.0)
"""Hands [N/m], [N s/m]."""
LONG_S, TREMBLE_S = 6.0, 3.0
"""How long a wall beyond the limit is pressed, and in what part of it is looked for the largest speed [s]."""
RATES = (1000.0, 2000.0, 4000.0)
"""[Hz]"""
PRESS, TAP_S, PRESSED_S = 20.0, 0.1, 1.6
"""How hard the hand presses in the end [N], how soon, and when the session ends [s]."""
LAST_S, STILL, LESS = 0.5, 1e-5, 0.9
"""In its last part [s] a stable wall gives the hand less than an energy [J], or a share of that before."""
SEED, STRENGTH = 1, 150.0
"""Of the sensors' noise; of the hand [N]."""


@dataclass(frozen=True, slots=True)
class Hand:
    """Of a person: stiffness [N/m], damping [N s/m]."""

    stiffness: float
    damping: float


@dataclass(frozen=True, slots=True)
class Beyond:
    """The first wall beyond the highest stable one [N/m], of a hand, a rate [Hz] and a mass [kg].

    Attributes:
        tremble: largest speed of the handle in the last seconds without and with the passivity layer [m/s].
    """

    hand: Hand
    rate: float
    mass: float
    wall: float
    tremble: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Width:
    """Of a hand and a rate [Hz]: the highest stable wall of each mass [N/m], 0 where there is none."""

    hand: Hand
    rate: float
    walls: Sequence[float]


def run(progress: Progress) -> Outcome:
    """At the configured rate, with the least damped hands."""
    return _outcome(RATES[:1], [Hand(*each) for each in product(STIFF, SOFTLY_DAMPED)], progress)


def study(progress: Progress) -> Outcome:
    """At all rates, with all hands."""
    return _outcome(RATES, [Hand(*each) for each in product(STIFF, DAMPED)], progress)


def machine(
    loaded: Loaded, mass: float, wall: float, hand: Hand, rate: float, passivity: bool = False
) -> Loaded:
    """The giant that renders a mass [kg] on a wall [N/m] at a rate [Hz] for a hand."""
    replaced = msgspec.structs.replace
    whole: Any = loaded.config
    free: Any = whole.giant.twin
    giant = replaced(whole.giant, twin=replaced(free, mass=type(free.mass)(mass)))
    # a twin's file is read beside what the configuration says: all else is set afterwards
    walled = haptify.with_slider(replace(loaded, config=replaced(whole, giant=giant)), wall)
    whole = believed(walled).config
    grip = whole.simulation.hand
    grip = replaced(
        grip, stiffness=type(grip.stiffness)(hand.stiffness), damping=type(grip.damping)(hand.damping)
    )
    loop = replaced(whole.loop, rate=type(whole.loop.rate)(rate))
    simulation = replaced(whole.simulation, hand=grip)
    control = replaced(whole.giant.force_control, passivity=passivity)
    giant = replaced(whole.giant, force_control=control)
    return replace(walled, config=replaced(whole, loop=loop, giant=giant, simulation=simulation))


def tap(start: Place, wall: float, hand: Hand, seconds: float = PRESSED_S) -> Way:
    """Down at once until wall and hand would hold each other with the press, and no further."""
    down = [*start[:2], start[2] - PRESS * (1.0 / wall + 1.0 / hand.stiffness), *start[3:]]
    still = np.linspace(TAP_S, seconds, 8).tolist()
    return [(0.0, start), *((t, down) for t in still)]


def taken(felt: Felt, hand: Hand, rate: float) -> float:
    """Energy that the damping of the hand takes from the handle, which nothing but the machine gives [J]."""
    return hand.damping * float((felt.velocity**2).sum()) / rate


def stable(felt: Felt, hand: Hand, rate: float) -> bool:
    """Whether the machine went on, and what trembled after the tap has died down, or is about to."""
    end = PRESSED_S
    before, last = (taken(felt.part(end - i * LAST_S, end - (i - 1) * LAST_S), hand, rate) for i in (2, 1))
    return not felt.stop and last < max(STILL, LESS * before)


def highest(walls: Sequence[float], holds: Callable[[float], bool]) -> float:
    """The last of rising walls that holds, as if all below one that holds did; 0 if none was found."""
    low, high = 0, len(walls)  # walls[:low] hold, walls[high:] do not
    while low < high:
        middle = (low + high) // 2
        low, high = (middle + 1, high) if holds(walls[middle]) else (low, middle)
    return walls[low - 1] if low else 0.0


def pressed(
    loaded: Loaded,
    mass: float,
    wall: float,
    hand: Hand,
    rate: float,
    passivity: bool = False,
    seconds: float = PRESSED_S,
) -> Felt:
    """The session in which a hand taps a wall; arguments as of ``machine``."""
    way = tap(haptify.first_place(loaded), wall, hand, seconds)
    walled = machine(loaded, mass, wall, hand, rate, passivity)
    return haptify.felt(walled, way, SEED, Doubt(), lambda _: None, STRENGTH)


def _outcome(rates: Sequence[float], hands: Sequence[Hand], progress: Progress) -> Outcome:
    loaded = config.load("giant")
    widths = [_width(loaded, hand, rate, progress) for rate, hand in product(rates, hands)]
    beyond = [
        _beyond(loaded, width, mass, wall, progress)
        for width in widths
        for mass, wall in zip(MASSES, width.walls, strict=True)
        if mass in JUDGED and wall < WALLS[-1]
    ]
    rows = [*map(_row, widths), *map(_beyond_row, beyond)]
    return Outcome(rows, _figures(widths, beyond), partial(_draw, widths))


def _width(loaded: Loaded, hand: Hand, rate: float, progress: Progress) -> Width:
    def holds(mass: float, wall: float) -> bool:
        progress(f"{rate:g} Hz, a hand of {hand.stiffness:g} N/m, {mass:g} kg on {wall:g} N/m")
        return stable(pressed(loaded, mass, wall, hand, rate), hand, rate)

    return Width(hand, rate, [highest(WALLS, partial(holds, mass)) for mass in MASSES])


def _beyond(loaded: Loaded, width: Width, mass: float, wall: float, progress: Progress) -> Beyond:
    hand, rate, above = width.hand, width.rate, WALLS[WALLS.index(wall) + 1 if wall else 0]

    def tremble(passivity: bool) -> float:
        layer = "with" if passivity else "without"
        progress(
            f"{rate:g} Hz, a hand of {hand.stiffness:g} N/m, {mass:g} kg on {above:g} N/m, {layer} layer"
        )
        felt = pressed(loaded, mass, above, hand, rate, passivity, LONG_S)
        last = felt.part(LONG_S - TREMBLE_S, LONG_S)
        return float(haptify.size(last.velocity).max()) if not felt.stop else np.inf

    return Beyond(hand, rate, mass, above, (tremble(False), tremble(True)))


def _name(hand: Hand, rate: float) -> str:
    return f"{rate / 1e3:g} kHz, hand of {hand.stiffness:g} N/m and {hand.damping:g} N s/m"


def _row(width: Width) -> Row:
    masses = " / ".join(f"{mass:g}" for mass in MASSES)
    walls = " / ".join(f"{wall / 1e3:g}" if wall else "none" for wall in width.walls)
    quantity = f"{_name(width.hand, width.rate)}: highest stable wall under {masses} kg [kN/m]"
    return Row(quantity, "-", walls, f"simulated; no higher than {WALLS[-1] / 1e3:g} was tried")


def _beyond_row(beyond: Beyond) -> Row:
    tremble = " / ".join(f"{1e3 * each:.1f}" if np.isfinite(each) else "stop" for each in beyond.tremble)
    at = f"{beyond.mass:g} kg on {beyond.wall / 1e3:g} kN/m"
    quantity = f"{_name(beyond.hand, beyond.rate)}, {at}: tremble without / with passivity layer [mm/s]"
    return Row(quantity, "-", tremble, f"simulated; fastest in the last {TREMBLE_S:g} of {LONG_S:g} s")


def _figures(widths: Sequence[Width], beyond: Sequence[Beyond]) -> dict[str, Any]:
    told = {"widths": widths, "beyond": beyond}
    return {"mass": MASSES, **{name: [msgspec.to_builtins(e) for e in each] for name, each in told.items()}}


def _draw(widths: Sequence[Width], figure: Any) -> None:
    rates = list(dict.fromkeys(width.rate for width in widths))
    plots = dict(zip(rates, figure.subplots(1, len(rates), sharey=True, squeeze=False)[0], strict=True))
    for width in widths:
        hand = width.hand
        plots[width.rate].loglog(
            MASSES,
            [wall or np.nan for wall in width.walls],
            color=COLOURS[STIFF.index(hand.stiffness)],
            ls=LINES[DAMPED.index(hand.damping)],
            marker="os^"[STIFF.index(hand.stiffness)],
            label=f"{hand.stiffness:g} N/m, {hand.damping:g} N s/m",
        )
    for rate, plot in plots.items():
        plot.set_title(f"{rate / 1e3:g} kHz")
        plot.set_xlabel("rendered mass [kg]")
        plot.set_xticks(MASSES, [f"{mass:g}" for mass in MASSES])
        plot.set_yticks(WALLS, [f"{wall:g}" for wall in WALLS])
        plot.set_ylim(WALLS[0] / 1.5, WALLS[-1] * 1.5)
        plot.minorticks_off()
    first = plots[rates[0]]
    first.set_ylabel("highest stable wall [N/m]")
    figure.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=7)
