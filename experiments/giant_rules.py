"""Beyond the paper: three rules of how limits reach the twin, beside each other on the built-in twins.

Each session is the script of a twin, on a plant of its own that rubs and whose sensors err. What is compared:
forces on the twin that no limit explains, how often limits become active or inactive, what is commanded of
the joints, and what the hand feels.

A force that no limit explains is, under the printed rules, slack of level 10: a constraint torque on a limit
that is not active, or of the wrong sign. Gauss's principle has no constraint torques: what its level 9, the
twin's dynamics, is left with is the force of the limits. There it is a tick whose force the limits that are
tight cannot push, as the multipliers of the levels above say.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..control.force_control import Detection, ForceControl
from ..control.twin import CartesianTwin
from ..hqp import HqpError
from ..hqp.multipliers import multipliers
from ..machines.giant.machine import Giant
from ..machines.giant.plant import GiantPlant
from ..models import Array
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import Lockstep, unswept
from . import haptify
from .outcome import COLOURS, LINES, Outcome, Progress, Row
from .own_plant import believed, own
from .rendered import MOVED, with_rule

TITLE = "the giant: three rules of how limits reach the twin"
RULES: tuple[Detection, ...] = ("gauss", "previous", "redetect")
PAPERS = RULES.index("previous")
TWINS = {
    "mass": ("giant", 30.0),
    "door": ("giant with door", 24.0),
    "excavator": ("giant with excavator", 24.0),
}
"""Machines with a twin, and how long their scripts are [s]."""
SEED = 1
"""Of the sensors' errors."""
PLANTS: dict[str, Callable[[Loaded], Loaded]] = {
    "own plant": partial(own, seed=SEED),
    "plant as believed": believed,
}
LEAST = 1e-3
"""Slack of a level of forces below this is none [N, N m]; under Gauss's principle in its metric."""
DYNAMICS, SIGN = "twin: dynamics", "constraints: sign"
"""Levels 9 and 10."""
SAMPLED = 5
"""Multipliers, and the force beyond the twin's, are looked at in one of so many ticks."""
SHAKES = 10.0
"""Above this frequency no hand moves on purpose [Hz]."""
ENOUGH = 2000
"""Ticks with an engaged hand that tell what it feels."""
DRAWN = 50
"""Of so many ticks the largest acceleration is drawn."""


@dataclass(frozen=True, slots=True)
class Session:
    """What became of a session in which k ticks rendered the twin.

    Attributes:
        unexplained: share of the ticks in which a force on the twin is none of a limit.
        toggles: how many limits had become active or inactive, (k,).
        acceleration, jerk: largest of each commanded joint, (6,) [rad, s].
        asked: largest commanded acceleration of a joint, as a share of its limit, (k,).
        beyond: mean size of the hand's force on the twin's joints that is not the twin's own [N or N m].
        shakes: RMS of the hand's force above ``SHAKES`` [N]; both are no numbers where the machine stopped
            too soon to tell.
        stop: why the machine stopped, "" where it did not; seconds: when.
    """

    unexplained: float
    toggles: NDArray[np.int64]
    acceleration: Array
    jerk: Array
    asked: Array
    beyond: float
    shakes: float
    stop: str
    seconds: float


class Watch:
    """Looks at every tick of a giant's session."""

    def __init__(self, lockstep: Lockstep) -> None:
        session, plant, machine = lockstep.session, lockstep.plant, lockstep.session.cycle.machine
        assert isinstance(plant, GiantPlant) and isinstance(machine, Giant)
        self._cycle, self._plant = session.cycle, plant
        self._rate = session.config.loop.rate
        self.control = machine.force_control
        self._limit = np.array(session.config.giant.manipulator.acceleration)  # type: ignore[attr-defined]
        self._moving, self._ticks = np.zeros(6), 0
        self._slack = np.zeros(len(self.control.levels))
        named = [name for name, _ in self.control.outline()]
        self._judged = named.index(DYNAMICS if self.control.detection == "gauss" else SIGN)
        self._unexplained: list[bool] = []
        self._rows: dict[str, list[NDArray[Any]]] = {"active": [], "qdd": [], "beyond": [], "force": []}
        prepare = self.control.prepare

        def pulled(wrench: Array, share: float = 1.0) -> None:
            self._moving[:] = wrench  # not what is measured: foretold
            prepare(wrench, share)

        self.control.prepare = pulled  # type: ignore[method-assign]

    def add(self) -> None:
        """Take a tick."""
        control, mode = self.control, self._cycle.mode
        if mode not in MOVED:
            return
        self._rows["active"].append(control.active.copy())
        self._rows["qdd"].append(control.qdd.copy())
        self._ticks += 1
        if control.detection != "gauss" or self._ticks % SAMPLED == 0:  # multipliers take their time
            self._unexplained.append(self._is_unexplained())
        if mode is Mode.ACTIVE:
            if self._ticks % SAMPLED == 0:
                self._rows["beyond"].append(beyond(control, self._plant, self._moving))
            self._rows["force"].append(self._plant.arm.hold.wrench[:3].copy())

    def _is_unexplained(self) -> bool:
        control = self.control
        control.write_slack(self._slack)
        left = bool(self._slack[self._judged] > LEAST)
        return left and not (control.detection == "gauss" and explained(control, self._judged))

    def session(self) -> Session:
        """All that was seen."""
        active, qdd, beyond, force = (np.array(rows) for rows in self._rows.values())
        told = len(force) >= ENOUGH
        trip = self._cycle.stops.last
        changed = np.count_nonzero(np.diff(active.astype(int), axis=0), axis=1)
        return Session(
            float(np.mean(self._unexplained)),
            np.concatenate([[0], np.cumsum(changed)]),
            np.abs(qdd).max(0),
            self._rate * np.abs(np.diff(qdd, axis=0)).max(0),
            np.asarray((np.abs(qdd) / self._limit).max(1)),
            float(haptify.size(beyond).mean()) if told else nan,
            haptify.vibration(force, self._rate, SHAKES).rms if told else nan,
            str(trip.verdict.detail) if trip else "",
            len(qdd) / self._rate,
        )


def explained(control: ForceControl, level: int) -> bool:
    """Whether the limits that are tight push what a level is left with."""
    try:
        multipliers(control.levels, control.solution.x, level)
    except HqpError:
        return False
    return True


def beyond(control: ForceControl, plant: GiantPlant, moving: Array) -> Array:
    """Force of the hand in the joints of the twin less what moves the twin as the handle moves.

    Hand and handle are those of the plant. Of a free mass it is the force alone, (3,) [N]; of a chain, (n,).

    Args:
        control: that renders the twin.
        plant: the machine.
        moving: wrench that moved the twin in this tick, (6,) in B [N, N m].
    """
    twin, arm = control.twin, plant.arm
    acceleration = arm.acceleration.copy()
    acceleration[:2] += plant.ppu.acceleration
    qdd = np.linalg.lstsq(twin.J, acceleration - twin.drift, rcond=None)[0]
    own = twin.M @ qdd + twin.J.T @ moving - twin.force
    found: Array = twin.J.T @ arm.hold.wrench - own
    return found[:3] if isinstance(twin, CartesianTwin) else found


def session(loaded: Loaded, rule: Detection, plant: str, seconds: float, progress: Progress) -> Session:
    """The script of a machine under a rule on one of ``PLANTS``, to its end or to a stop."""
    lockstep = Lockstep(build(PLANTS[plant](with_rule(loaded, rule))))
    watch, cycle = Watch(lockstep), lockstep.session.cycle
    rate = lockstep.session.config.loop.rate
    with unswept():
        for tick in range(round(seconds * rate)):
            lockstep.tick()
            if cycle.stops.last or cycle.mode is Mode.FAILED:
                break
            watch.add()
            if tick % 5000 == 0:
                progress(f"{loaded.name}, {rule}: {tick / rate:.0f} of {seconds:g} s")
    return watch.session()


def run(progress: Progress) -> Outcome:
    """The plant of its own."""
    return _outcome(list(PLANTS)[:1], progress)


def study(progress: Progress) -> Outcome:
    """That, and the plant that its controller believes in."""
    return _outcome(list(PLANTS), progress)


def _outcome(plants: Sequence[str], progress: Progress) -> Outcome:
    found = {
        f"{twin}, {plant}": [session(config.load(name), rule, plant, seconds, progress) for rule in RULES]
        for plant in plants
        for twin, (name, seconds) in TWINS.items()
    }
    rows = [row for name, sessions in found.items() for row in _rows(name, sessions)]
    figures = {
        name: {rule: _figures(each) for rule, each in zip(RULES, sessions, strict=True)}
        for name, sessions in found.items()
    }
    return Outcome(rows, figures, partial(_draw, dict(list(found.items())[: len(TWINS)])), (9.0, 5.0))


def _figures(each: Session) -> dict[str, Any]:
    return {
        "unexplained": each.unexplained,
        "toggles": int(each.toggles[-1]),
        "acceleration": each.acceleration.tolist(),
        "jerk": each.jerk.tolist(),
        "beyond": each.beyond,
        "shakes": each.shakes,
        "stop": each.stop,
    }


def worst_ratio(values: Array, papers: Array) -> float:
    """Largest ratio of joints' values to those under the paper's rule, (m,) each; of joints that move."""
    moves = papers > 1e-3
    return float((values[moves] / papers[moves]).max())


def _rows(name: str, sessions: Sequence[Session]) -> list[Row]:
    def row(what: str, values: Sequence[str], note: str = "") -> Row:
        return Row(f"{name}: {what}, {' / '.join(RULES)}", "-", " / ".join(values), note)

    def ratios(values: Sequence[Array]) -> str:
        shares = " / ".join(f"{worst_ratio(each, values[PAPERS]):.2f}" for each in values)
        return f"joint by joint at most {shares} of that under the paper's rule"

    accelerations, jerks = [s.acceleration for s in sessions], [s.jerk for s in sessions]
    unit = "N" if name.startswith("mass") else "N m"
    stops = [f"after {s.seconds:.1f} s: {s.stop}" if s.stop else "none" for s in sessions]
    return [
        row(
            "ticks with a force on the twin that is none of a limit [%]",
            [f"{100 * s.unexplained:.3f}" for s in sessions],
        ),
        row("toggles of active limits", [f"{s.toggles[-1]}" for s in sessions]),
        row(
            "largest commanded acceleration of a joint [rad/s^2]",
            [f"{each.max():.1f}" for each in accelerations],
            ratios(accelerations),
        ),
        row("largest jerk of a joint [rad/s^3]", [f"{each.max():.0f}" for each in jerks], ratios(jerks)),
        row(
            f"force of the hand beyond the twin's, mean [{unit}]",
            [f"{s.beyond:.2f}" for s in sessions],
            "with that of the limits, which the script presses against",
        ),
        row(f"force of the hand above {SHAKES:g} Hz, RMS [N]", [f"{s.shakes:.3f}" for s in sessions]),
        row("stops of the machine", stops),
    ]


def _draw(found: dict[str, list[Session]], figure: Any) -> None:
    plots = figure.subplots(2, len(found), sharex="col", squeeze=False)
    for column, (name, sessions) in enumerate(found.items()):
        asked, toggles = plots[:, column]
        styles = zip(RULES, sessions, COLOURS, LINES, strict=False)
        for k, (rule, each, colour, line) in enumerate(styles):
            shown = {"color": colour, "ls": line, "lw": 1.1, "label": rule, "zorder": 3.0 - 0.1 * k}
            blocks = len(each.asked) // DRAWN
            t = each.seconds * (np.arange(blocks) + 0.5) / blocks
            most = each.asked[: blocks * DRAWN].reshape(blocks, DRAWN).max(1)
            asked.semilogy(t, np.maximum(100.0 * most, 0.01), **shown)
            toggles.plot(t, each.toggles[: blocks * DRAWN : DRAWN], **shown)
        asked.set_title(name.partition(",")[0])
        asked.set_ylabel("largest acceleration [% of the limit]")
        toggles.set_ylabel("toggles until then")
        toggles.set_xlabel("time since the twin is rendered [s]")
    figure.legend(*plots[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
