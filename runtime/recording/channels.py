"""The channels of a machine: every number of a tick that people look at, with its name and unit.

One table for whoever shows them: reports, dashboards, terminals. It follows from what the machine says of its
limits, its figures and its scene, and from what every record begins with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import inf

import numpy as np

from ..configuration.session import Session
from ..core.machine import Solving
from ..core.modes import RENDERING, Mode
from ..core.stages import Stage


class Group(StrEnum):
    """What a channel is about."""

    PUNCTUALITY = "punctuality"
    STAGES = "stages"
    LIMITS = "limits"
    HAND = "hand"
    FIGURES = "figures"
    SAFETY = "safety"
    BUS = "bus"
    SOLVER = "solver"


@dataclass(frozen=True, slots=True)
class Channel:
    """A number of every tick.

    Attributes:
        name: for people.
        unit: of its values; empty for counts and shares.
        group: what it is about.
        lower, upper: what the machine keeps it in; infinite where there is no limit.
    """

    name: str
    unit: str
    group: Group
    lower: float = -inf
    upper: float = inf


HEARD = "dead-man last heard"
STATUS, PROVEN, SLACK = "solver status", "levels proven", "slack of "
"""Channels of a machine that solves a hierarchy; of the last one a level each."""
MET = 1e-6
"""A level with no more slack is met."""
FORCE = tuple(f"force {axis}" for axis in "xyz")
TORQUE = tuple(f"torque {axis}" for axis in "xyz")


class Channels:
    """The channels of one machine, and their values in a record.

    Attributes:
        specs: the channels.
        groups: where those of each group stand among them.
    """

    def __init__(self, session: Session) -> None:
        system, config = session.system, session.config
        self._limits, self._figures = system.limits(config), system.figures(config)
        self._scene = system.scene(config) if system.scene else None
        self._expected = session.cycle.image.expected
        axes = (*((name, "N") for name in FORCE), *((name, "N m") for name in TORQUE))
        grips = self._scene.grips if self._scene else ()
        hand = [(f"{grip.name} {name}".strip(), unit) for grip in grips for name, unit in axes]
        machine = session.cycle.machine
        self._solves = isinstance(machine, Solving) and bool(machine.levels)
        levels = machine.levels if isinstance(machine, Solving) else ()
        self._period_ms = 1e3 / float(config.loop.rate)
        groups = {
            Group.PUNCTUALITY: [Channel(name, "us", Group.PUNCTUALITY) for name in ("lateness", "compute")],
            Group.STAGES: [Channel(stage.name.lower(), "us", Group.STAGES) for stage in Stage],
            Group.SAFETY: [
                Channel("wrench faded in", "", Group.SAFETY),
                Channel("wrench believed", "", Group.SAFETY),
                Channel("answers missing", "", Group.SAFETY),
                Channel("ticks skipped", "", Group.SAFETY),
            ],
            Group.LIMITS: [
                Channel(spec.name, spec.unit, Group.LIMITS, float(spec.lower), float(spec.upper))
                for spec in self._limits.specs
            ],
            Group.HAND: [Channel(name, unit, Group.HAND) for name, unit in hand],
            Group.FIGURES: [Channel(spec.name, spec.unit, Group.FIGURES) for spec in self._figures.specs],
            Group.BUS: [
                Channel("frames received", "", Group.BUS),
                Channel("frames discarded", "", Group.BUS),
                Channel(HEARD, "ms", Group.BUS),
            ],
            Group.SOLVER: [
                *(Channel(name, "", Group.SOLVER) for name in (STATUS, PROVEN) if levels),
                *(Channel(f"{SLACK}{level.name}", level.unit, Group.SOLVER) for level in levels),
            ],
        }
        self.specs = tuple(spec for specs in groups.values() for spec in specs)
        self.groups: dict[Group, slice] = {}
        for group, specs in groups.items():
            start = max((end.stop for end in self.groups.values()), default=0)
            self.groups[group] = slice(start, start + len(specs))
        self._still = [0.0] * len(self._figures.specs)
        self._unsolved = [0.0] * len(groups[Group.SOLVER])

    def values(self, fixed: np.void) -> list[float]:
        """Their values in the fixed part of a record of a tick that has measured; see ``measured``."""
        state = fixed["state"]
        stages = fixed["stage_ns"].tolist()
        rendering = int(fixed["mode"]) in RENDERING
        return [
            *(1e-3 * int(fixed["lateness_ns"]), 1e-3 * int(fixed["compute_ns"])),
            *(1e-3 * ns for ns in stages),
            *(float(fixed["gain"]), float(fixed["trust"])),
            *(float(self._expected - int(fixed["working_counter"])), float(fixed["skipped"])),
            *self._limits.values(state),
            *(self._scene.wrench(state) if self._scene else ()),
            *(self._figures.values(state) if rendering else self._still),
            *(float(fixed["frames"]), float(fixed["discarded"]), self._period_ms * int(fixed["silent"])),
            *(_solver(state) if rendering and self._solves else self._unsolved),
        ]


def _solver(state: np.void) -> list[float]:
    """Status, levels proven and the slack of each; what was refused has none."""
    slack: list[float] = np.nan_to_num(state["slack"]).tolist()
    return [float(state["status"]), float(state["levels_done"]), *slack]


def slacks(channels: Sequence[Channel]) -> list[tuple[int, str, str]]:
    """Of each level of the solver: where its slack stands among the channels, its name, its unit."""
    return [
        (k, channel.name.removeprefix(SLACK), channel.unit)
        for k, channel in enumerate(channels)
        if channel.group is Group.SOLVER and channel.name.startswith(SLACK)
    ]


def measured(mode: int) -> bool:
    """Whether a tick after one in this mode knows where the machine is: during bring-up none does."""
    return mode not in (Mode.BRINGUP, Mode.FAILED)
