"""Beyond the paper's figures: VI-E's feedforward of friction, identified on the plant that it then moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from ..machines.giant.config import GiantConfig
from ..models import Array
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from . import giant_table3, haptify
from .excited_joints import excite, links_of
from .felt import Felt, felt
from .giant_felt import PASSIVE
from .identification import identify
from .identify import known_of
from .outcome import COLOURS, Outcome, Progress, Row
from .own_plant import Doubt
from .recorded_joints import FRICTION

TITLE = "the giant: friction of gears and bearings fed forward"
DOUBT = Doubt(errors=True)
"""The plant rubs, and its sensors err; else it is what the controller believes."""
IDENTIFIED = 3
"""Seed of the course, and of the sensors' errors along it: not those of the sessions that are measured."""
COURSE_S = 30.0
FIRST, PLANTS = 11, 3
"""Seeds of the sessions."""
STRENGTH = 300.0
"""Of the hand that wanders [N]."""
SHAKES = 10.0
"""Above this frequency no hand moves on purpose [Hz]."""
SHARES = {"none": 0.0, "as identified": 1.0, "0.7 times": 0.7, "1.3 times": 1.3}
"""How much of what was identified is fed forward."""


@dataclass(frozen=True, slots=True)
class Measured:
    """Of sessions with one feedforward.

    Attributes:
        strayed: RMS of each link's distance from where it is led, (6,) [rad].
        force, added: mean force of the wandering hand, and of what the free mass does not account for [N].
        shakes: RMS of the handle's acceleration above ``SHAKES`` [m/s^2].
        along: what a shaken handle feels along each axis.
        stops: of the machine.
    """

    strayed: Array
    force: float
    added: float
    shakes: float
    along: list[Felt]
    stops: list[str]


def told(loaded: Loaded) -> Loaded:
    """The giant with the friction that `hapticd identify` tells of a plant that rubs."""
    assert isinstance(loaded.config, GiantConfig)
    excited, dt = excite(loaded, COURSE_S, IDENTIFIED, DOUBT), 1.0 / loaded.config.loop.rate
    found = [(joint, identify(runs, joint.torque, joint.speed, dt)) for joint, runs in excited.joints]
    known = known_of(found, links_of(excited, dt))
    return with_friction(loaded, {key: [values[key] for values in known] for key in FRICTION})


def with_friction(loaded: Loaded, values: dict[str, list[float]]) -> Loaded:
    """The giant that feeds forward what ``values`` say of each joint, by key."""
    whole = loaded.config
    assert isinstance(whole, GiantConfig)
    tracking = msgspec.structs.replace(
        whole.giant.tracking, **{key: tuple(value) for key, value in values.items()}
    )
    giant = msgspec.structs.replace(whole.giant, tracking=tracking)
    return replace(loaded, config=msgspec.structs.replace(whole, giant=giant))


def scaled(loaded: Loaded, share: float) -> Loaded:
    """A share of the friction that is fed forward."""
    whole: Any = loaded.config
    now = {key: getattr(whole.giant.tracking, key) or (0.0,) * 6 for key in FRICTION}
    return with_friction(loaded, {key: [share * x for x in values] for key, values in now.items()})


def unled(loaded: Loaded) -> list[Felt]:
    """What a shaken handle feels along each axis where the twin is moved by the wrench as it is measured."""
    whole = loaded.config
    assert isinstance(whole, GiantConfig)
    control = msgspec.structs.replace(whole.giant.force_control, lead=None)
    giant = msgspec.structs.replace(whole.giant, force_control=control)
    varied = DOUBT.vary(msgspec.structs.replace(whole, giant=giant), FIRST)
    assert isinstance(varied, GiantConfig)
    return felt(loaded, varied)


def measure(loaded: Loaded, progress: Progress) -> Measured:
    """A hand that wanders in several sessions, and one that shakes the handle."""
    start = haptify.first_place(loaded)
    sessions = [
        haptify.felt(loaded, giant_table3.wandering(start, seed), seed, DOUBT, progress, STRENGTH)
        for seed in range(FIRST, FIRST + PLANTS)
    ]
    strayed = np.concatenate([session.strayed for session in sessions])
    force = np.concatenate([session.force for session in sessions])
    added = np.concatenate([session.force - giant_table3.own(session, loaded) for session in sessions])
    rates = [haptify.vibration(session.acceleration, giant_table3.RATE, SHAKES).rms for session in sessions]
    varied = DOUBT.vary(loaded.config, FIRST)
    assert isinstance(varied, GiantConfig)
    return Measured(
        np.sqrt((strayed**2).mean(0)),
        float(haptify.size(force).mean()),
        float(haptify.size(added).mean()),
        float(np.sqrt(np.mean(np.square(rates)))),
        felt(loaded, varied),
        [session.stop for session in sessions if session.stop],
    )


def run(progress: Progress) -> Outcome:
    """Nothing, what was identified, and too little and too much of it."""
    loaded = config.load("giant")
    progress("identifying")
    known = told(loaded)
    found = {name: measure(scaled(known, share), progress) for name, share in SHARES.items()}
    late = unled(known)
    rows = [row for name, each in found.items() for row in _rows(name, each)]
    rows.append(_true("as identified, but the twin moved by the wrench as it is measured", late))
    figures = {
        name: {
            **{"strayed": each.strayed.tolist(), "force": each.force, "added": each.added},
            **{"shakes": each.shakes, "resistance": _least(each.along), "stops": each.stops},
        }
        for name, each in found.items()
    } | {"unled": {"resistance": _least(late)}}

    def draw(figure: Any) -> None:
        plot = figure.subplots()
        for k, ((name, each), colour) in enumerate(zip(found.items(), COLOURS, strict=True)):
            at = np.arange(len(each.strayed)) + 0.2 * k
            plot.bar(at, 1e3 * each.strayed, 0.18, color=colour, label=f"fed forward: {name}")
        plot.set_xticks(np.arange(6) + 0.3, [f"joint {i + 1}" for i in range(6)])
        plot.set_xlabel("joint")
        plot.set_ylabel("RMS of link less commanded [mrad]")
        plot.legend(fontsize=8)

    return Outcome(rows, figures, draw, (8.0, 4.0))


def _rows(name: str, each: Measured) -> list[Row]:
    strayed = " / ".join(f"{1e3 * x:.2f}" for x in each.strayed)
    what = f"friction fed forward: {name}"
    return [
        Row(f"{what}: links from where they are led, RMS, joints 1 to 6 [mrad]", "-", strayed),
        Row(
            f"{what}: mean force that the free mass does not account for [N]",
            "-",
            f"{each.added:.3f}",
            f"of {each.force:.2f} N; above {SHAKES:g} Hz the handle shakes with {each.shakes:.3f} m/s^2",
        ),
        _true(name, each.along, f"; stops: {len(each.stops)}"),
    ]


def _true(name: str, along: list[Felt], more: str = "") -> Row:
    return Row(
        f"friction fed forward: {name}: within 1 dB and 10 degrees of the twin up to, x / y / z [Hz]",
        "-",
        " / ".join(f"{each.true_up_to():g}" for each in along),
        f"least Re(F/v) up to {PASSIVE:g} Hz: {_least(along):.1f} N s/m{more}",
    )


def _least(along: list[Felt]) -> float:
    return min(float(each.resistance[each.frequency <= PASSIVE].min()) for each in along)
