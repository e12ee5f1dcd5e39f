"""Beyond the paper: the redundant interface under random hands, at random walls, from random homes.

What is told is how near its motors come to the limits of their joints, and how far a motor's torque steps
from tick to tick beyond what the change of the demanded force explains.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..machines.rhi.machine import RedundantInterface
from ..models import Array
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import Lockstep
from .hands import Session, session
from .outcome import Outcome, Progress, Row
from .temper import Temper
from .workers import pool_of

TITLE = "random walls, homes and hands"
TEMPER = Temper(30.0, 10.0, 0.5)
SECONDS = 15.0
FIRST, FEW, MANY = 43_001, 6, 1000
"""Seed of the first hand; sessions of a quick run and of a study."""
WORKERS = os.cpu_count() or 1
STEPS = np.linspace(0.0, 0.4, 41)
"""Edges of the classes of steps, as shares of a motor's limit; what is larger counts with the last."""


@dataclass(frozen=True, slots=True)
class Handled:
    """What became of a session.

    Attributes:
        session: as of any machine.
        steps: how many ticks had their largest step of a torque in each class of STEPS, (classes,).
        largest: of all steps, as a share of the motor's limit.
    """

    session: Session
    steps: Array
    largest: float

    @property
    def room(self) -> dict[str, float]:
        """How near each motor came to a limit of its joint [rad]; negative beyond."""
        return {name: -excess for name, excess in self.session.excess.items() if not name.endswith(OTHER)}


OTHER = ("torque", "velocity")
"""Last words of limits that are none of a joint's angle."""


class Steps:
    """Steps of the motors' torques while an interface in lockstep renders."""

    def __init__(self) -> None:
        self.counts, self.largest = np.zeros(len(STEPS) - 1), 0.0
        self._before: tuple[Array, Array] | None = None

    def add(self, lockstep: Lockstep) -> None:
        """Take a tick."""
        cycle = lockstep.session.cycle
        if cycle.mode is not Mode.ACTIVE:
            self._before = None
            return
        machine = cycle.machine
        assert isinstance(machine, RedundantInterface)
        controller = machine.controller
        arm, torque = controller.arm, controller.torque.copy()
        force = machine.environment.force(arm.position.tolist(), arm.velocity.tolist())
        demand = np.array(force)
        if self._before:
            change = torque - self._before[0], demand - self._before[1]
            step = unexplained(*change, arm.J, controller.space.limit)
            self.largest = max(self.largest, step)
            self.counts[np.searchsorted(STEPS[1:-1], step, "right")] += 1
        self._before = torque, demand


def unexplained(torque: Array, demand: Array, J: Array, limit: Array) -> float:
    """Largest share of a limit by which a torque steps further than the demand, of all motors; at least 0.

    Args:
        torque: change of the motors' torques, (n,) [N m].
        demand: change of the force that the environment asks for, (m,) [N].
        J: (m, n).
        limit: of the motors, (n,) [N m].
    """
    return max(0.0, float(((np.abs(torque) - np.abs(demand @ J)) / limit).max()))


def handled(loaded: Loaded, seed: int) -> Handled:
    """The session of a seed."""
    steps = Steps()
    found = session(loaded, seed, SECONDS, TEMPER, steps.add)
    return Handled(found, steps.counts, steps.largest)


def run(progress: Progress) -> Outcome:
    """A few sessions."""
    return outcome(sessions(FEW, progress))


def study(progress: Progress) -> Outcome:
    """As many as say something."""
    return outcome(sessions(MANY, progress))


def sessions(count: int, progress: Progress) -> list[Handled]:
    """Of so many seeds, in their order."""
    one, seeds = partial(handled, config.load("rhi")), range(FIRST, FIRST + count)
    found: list[Handled] = []
    with pool_of(WORKERS) as pool:
        for each in pool.map(one, seeds) if WORKERS > 1 else map(one, seeds):
            found.append(each)
            progress(f"session {len(found)} of {count}")
    return found


def outcome(found: Sequence[Handled]) -> Outcome:
    """Rows and plot of sessions."""
    stopped = [each.session for each in found if each.session.stop]
    nearest, motor, seed = min(
        (room, name, each.session.seed) for each in found for name, room in each.room.items()
    )
    steepest = max(found, key=lambda each: each.largest)
    given = max(found, key=lambda each: each.session.returned).session
    why = "; ".join(f"seed {each.seed}: {each.stop}" for each in stopped)
    told = f"{TEMPER.force:g} N, {TEMPER.speed:g} m/s, {SECONDS:g} s each; seeds {FIRST} on"
    rows = [
        Row("sessions", "-", str(len(found)), told),
        Row("of them stopped", "-", str(len(stopped)), why),
        Row(
            "motor nearest to a limit of its joint [mrad]",
            "-",
            f"{1e3 * nearest:.0f}",
            f"{motor}, seed {seed}",
        ),
        Row(
            "largest step of a torque beyond what the demand's change explains, of its limit",
            "-",
            f"{100.0 * steepest.largest:.1f} %",
            f"tick to tick; seed {steepest.session.seed}",
        ),
        Row(
            "energy given back to a hand, at most [mJ]",
            "-",
            f"{1e3 * given.returned:.1f}",
            f"seed {given.seed}",
        ),
    ]
    figures = {
        "sessions": [
            {
                "seed": each.session.seed,
                "stop": each.session.stop,
                "room": each.room,
                "step": each.largest,
                "returned": each.session.returned,
            }
            for each in found
        ]
    }
    return Outcome(rows, figures, partial(_draw, found), (9.0, 3.8))


def _draw(found: Sequence[Handled], figure: Any) -> None:
    left, right = figure.subplots(1, 2)
    left.stairs(sum(each.steps for each in found), 100.0 * STEPS, fill=True)
    left.set(yscale="log", xlabel="step of a torque beyond the demand's [% of its limit]", ylabel="ticks")
    room = [1e3 * room for each in found for room in each.room.values()]
    right.hist(room, bins=24)
    right.axvline(0.0, color="black", lw=0.8)
    right.set(
        xlabel="least distance of a motor to its joint's limits [mrad]", ylabel="motors of all sessions"
    )
