"""Bimanual, V-B: a hand is lowered onto a table that nobody sees, with feedback and without."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..models import Array
from ..sim.peg_task import PegTask
from .lean_pair import DT, FollowingPair, leading_pair
from .outcome import Outcome, Progress, Row
from .peg_trial import exchange

TITLE = "contact with a table out of sight, in simulation"
SEEDS = range(2001, 2005)
PLACE, TOP = np.array((0.55, 0.32, 0.93)), 0.865
"""Where the left palm begins, and how low it gets on the table [m]."""
BELIEF = 0.02
"""Error of where the person believes the table to be, standard deviation [m]."""
LOWERS, FEELS, REACTS = 0.04, 2.0, 0.1
"""Speed down [m/s]; force at which a person who feels it stops [N], after so long [s]."""
GETS_THERE, SECONDS = 1.5, 4.0


@dataclass(frozen=True, slots=True)
class Touch:
    """One hand that goes down.

    Attributes:
        force: of the table on the avatar's hand, each tick, (k,) [N].
        believed: where the person thought the palm would be stopped, above where it is [m].
    """

    force: Array
    believed: float


class Lowered:
    """The way of a palm: to a place, then down until something stops the person."""

    def __init__(self, first: Array, lowest: float) -> None:
        self._first, self._lowest = first, lowest
        self.stopped: float | None = None

    def at(self, t: float) -> tuple[list[float], list[float]]:
        """See ``hapticd.sim.hand.Course``."""
        s = min(t / GETS_THERE, 1.0)
        share = s * s * (3.0 - 2.0 * s)
        x, y, z = (self._first + share * (PLACE - self._first)).tolist()
        height = z - LOWERS * max(0.0, min(t, self.stopped or t) - GETS_THERE)
        return [x, y, max(height, self._lowest), 0.0, 0.0, 0.0], [0.0] * 6


class Still:
    """The way of a palm that stays."""

    def __init__(self, place: Array) -> None:
        self._value = [*place.tolist(), 0.0, 0.0, 0.0]

    def at(self, t: float) -> tuple[list[float], list[float]]:
        """See ``hapticd.sim.hand.Course``."""
        return self._value, [0.0] * 6


def touch(seed: int, feedback: bool) -> Touch:
    """Lower the left hand; who feels nothing stops where the table is believed to be."""
    believed = BELIEF * float(np.random.default_rng([seed, 31]).normal())
    task = PegTask()
    avatar = FollowingPair(task.scene, seed)
    ways = Lowered(avatar.arms[0].position.copy(), TOP + (-1.0 if feedback else believed))
    lead = leading_pair([ways, Still(avatar.arms[1].position.copy())], float(feedback), seed)
    palm = lead[0].limb.arm
    forces, since, base = [], 0.0, 0.0
    for k in range(round(SECONDS / DT)):
        t = k * DT
        exchange(lead, avatar, t, feedback)
        forces.append(float(task.scene.touch("world", "left")[2]))
        felt = -float(palm.hold.wrench[2])
        if t < GETS_THERE + 0.3:
            base += 0.01 * (felt - base)  # what the arm itself weighs
        elif feedback and ways.stopped is None:
            since = since + DT if felt - base > FEELS else 0.0
            if since > REACTS:
                ways.stopped = t
    return Touch(np.array(forces), believed)


def run(progress: Progress) -> Outcome:
    """The same tables with and without."""
    seen: dict[str, list[Touch]] = {}
    for name, feedback in (("with feedback", True), ("without feedback", False)):
        seen[name] = []
        for seed in SEEDS:
            progress(f"{name}, seed {seed}")
            seen[name].append(touch(seed, feedback))
    rows, figures = [], {}
    for name, touches in seen.items():
        peaks = [float(each.force.max()) for each in touches]
        touched = sum(each.force[-1] > 0.1 for each in touches)
        figures[name.replace(" ", "_")] = {"peak_n": peaks, "touched": touched}
        note = f"mean and most of {len(peaks)}; the table is believed {1e3 * BELIEF:.0f} mm off"
        here = f"{np.mean(peaks):.1f}, {max(peaks):.1f}"
        rows.append(Row(f"largest force, {name} [N]", "-", here, note))
        paper = "clearest advantage where the table is hidden (a questionnaire)"
        rows.append(Row(f"rests on the table, {name}", paper, f"{touched}/{len(peaks)}"))

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 2, sharey=True)
        for each, (name, touches) in zip(axes, seen.items(), strict=True):
            for one in touches:
                each.plot(DT * np.arange(len(one.force)), one.force, color="tab:blue", linestyle="-")
            each.set(title=name, xlabel="time [s]")
        axes[0].set_ylabel("force of the table on the hand [N]")

    return Outcome(rows, figures, draw, (8.0, 3.5))
