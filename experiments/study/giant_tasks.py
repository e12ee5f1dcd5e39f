"""What participants do with the giant (HapticGiant, VII-D), and what recordings say of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from ...configs.quantities import Angle, AnyAngle, Length, Lengths2
from ...configs.strict import Strict
from ...machines.giant.kinematics import points
from ...models import Array
from ...runtime.core.modes import RENDERING
from ...runtime.recording.log import open_log
from .entries import Seconds, Text
from .protocol import Column
from .settings import StudyError

HINGE = "hinge"
"""The joint of the door, among those of the twins."""
OPEN, THROUGH = 0.1, 1.0
"""The door is open, and wide enough to walk through, from these angles of its hinge on [rad]."""
BESIDE = 0.2
"""Simulated hands miss a checkpoint by some of this share of what is near."""
WAITS_S = 4.0
"""Simulated hands stay at the first checkpoint for so long: the machine engages."""
PACE, TURN_S = (0.35, 0.6), 1.5
"""Of simulated hands: how fast they walk [m/s]; least time from checkpoint to checkpoint."""
HASTE = (0.9, 1.1)
"""Times of a simulated hand at the door over those of the twin's own."""
GRIP, SLACK = (400.0, 1200.0), (25.0, 40.0)
"""Their stiffness [N/m] and damping [N s/m]."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What a recording says of k ticks in which the machine rendered.

    Attributes:
        t: from the first of them, (k,) [s].
        place: of the handle in B, (k, 3) [m]; yaw: where it points, (k,) [rad].
        force: size of the participant's, (k,) [N].
        hinge: of the door, (k,) [rad]; None where the twin has none.
    """

    t: Array
    place: Array
    yaw: Array
    force: Array
    hinge: Array | None


def motion_of(path: Path) -> Motion:
    """What a recording of the giant says.

    Raises:
        StudyError: the machine never rendered in it.
        LogError: it is damaged.
    """
    log = open_log(str(path))
    rate = log.loaded.config.loop.rate
    rows = []
    for record in log.records():
        if int(record.fixed["mode"]) not in RENDERING:
            continue
        state = record.fixed["state"]
        link = state["link"].tolist()
        handle, _ = points(link, state["axis"].tolist())
        joints = state["twin"].dtype.names if "twin" in (state.dtype.names or ()) else ()
        angle = float(state["twin"][HINGE]) if HINGE in joints else np.nan
        push = float(np.linalg.norm(state["wrench"][:3]))
        rows.append([int(record.fixed["tick"]) / rate, *handle, sum(link[:3]), push, angle])
    if not rows:
        raise StudyError(f"{path}: the machine was never engaged; nothing can be said of this trial")
    table = np.array(rows)
    hinge = None if np.isnan(table[:, 6]).any() else table[:, 6]
    return Motion(table[:, 0] - table[0, 0], table[:, 1:4], table[:, 4], table[:, 5], hinge)


class Checkpoint(Strict, frozen=True):
    """A place on the ground of the room, and where the handle is to point there."""

    at: Lengths2
    pointing: AnyAngle


class Door(Strict, frozen=True, kw_only=True, tag_field="kind", tag="door"):
    """A door is opened and walked through."""

    seconds: Seconds
    instruction: Text

    @property
    def kind(self) -> str:
        """Its name in the data."""
        return "door"

    @property
    def twin(self) -> str:
        """Of the machine."""
        return "door"

    @property
    def columns(self) -> Mapping[str, Column]:
        """Of ``judge``."""
        return {
            "opened": Column(f"when the hinge had turned by {OPEN:g} rad", "s"),
            "through": Column(f"when it had turned by {THROUGH:g} rad: wide enough to walk through", "s"),
        }

    def judge(self, motion: Motion) -> dict[str, Any]:
        """When the door was open and wide open [s], None where it never was."""
        assert motion.hinge is not None
        through = first(motion.t, motion.hinge >= THROUGH)
        opened = first(motion.t, motion.hinge >= OPEN)
        return {"done": int(through is not None), "opened": opened, "through": through}

    def led(self, hand: Any, pace: float, random: Random) -> dict[str, Any]:
        """What a simulated hand does: what the twin's own does, a little sooner or later."""
        haste = random.uniform(*HASTE)
        return {
            key: tuple(_at(each, each.at * haste) for each in getattr(hand, key)) for key in ("path", "away")
        }


class Way(Strict, frozen=True, kw_only=True, tag_field="kind", tag="path"):
    """The handle is led over checkpoints, one after the other."""

    seconds: Seconds
    instruction: Text
    checkpoints: Annotated[tuple[Checkpoint, ...], Meta(min_length=2, max_length=100)]
    near: Length
    aligned: Angle

    @property
    def kind(self) -> str:
        """Its name in the data."""
        return "path"

    @property
    def twin(self) -> str:
        """Of the machine: its own, a free mass."""
        return ""

    @property
    def columns(self) -> Mapping[str, Column]:
        """Of ``judge``."""
        when = {
            f"checkpoint_{k}": Column(f"when checkpoint {k} was reached after those before it", "s")
            for k in range(1, len(self.checkpoints) + 1)
        }
        counted = Column(f"checkpoints that were reached, of {len(self.checkpoints)}")
        return {
            "checkpoints": counted,
            **when,
            "way": Column("length of the handle's way over the ground", "m"),
        }

    def judge(self, motion: Motion) -> dict[str, Any]:
        """When each checkpoint was reached after the one before [s], and how long the way was [m]."""
        reached: list[float] = []
        begin = 0
        for checkpoint in self.checkpoints:
            x, y = checkpoint.at
            away = np.hypot(motion.place[begin:, 0] - x, motion.place[begin:, 1] - y)
            turned = np.remainder(motion.yaw[begin:] - checkpoint.pointing + np.pi, 2.0 * np.pi) - np.pi
            hits = np.flatnonzero((away <= self.near) & (np.abs(turned) <= self.aligned))
            if not hits.size:
                break
            begin += int(hits[0])
            reached.append(float(motion.t[begin]))
        steps = np.linalg.norm(np.diff(motion.place[:, :2], axis=0), axis=1)
        return {
            "done": int(len(reached) == len(self.checkpoints)),
            "checkpoints": len(reached),
            **{f"checkpoint_{k}": t for k, t in enumerate(reached, 1)},
            "way": float(steps.sum()),
        }

    def led(self, hand: Any, pace: float, random: Random) -> dict[str, Any]:
        """What a simulated hand does: it goes over the checkpoints at a pace [m/s], a little beside them."""
        start = hand.path[0]
        t, place, beside = WAITS_S, np.array(start.position[:2]), BESIDE * self.near
        way = [(0.0, start), (t - 0.2, start), (t, start)]
        for checkpoint in self.checkpoints:
            there = np.array([random.gauss(x, beside) for x in checkpoint.at])
            t += max(float(np.linalg.norm(there - place)) / pace, TURN_S)
            position = (*there.tolist(), start.position[2])
            angles = (float(checkpoint.pointing), *start.angles[1:])
            way.append((t, msgspec.structs.replace(start, position=position, angles=angles)))
            place = there
        way.append((t + TURN_S, way[-1][1]))
        return {"path": tuple(_at(pose, at) for at, pose in way)}


Task = Door | Way
COLUMNS = {
    "done": Column("whether it was done", levels={"1": "yes", "0": "no"}),
    "duration": Column("from the moment from which the machine rendered until the session ended", "s"),
    "mean_force": Column("mean size of the participant's force", "N"),
    "peak_force": Column("largest size of the participant's force", "N"),
}
"""Of every task."""


def judged(task: Task, motion: Motion) -> dict[str, Any]:
    """A trial in numbers."""
    forces = {"mean_force": float(motion.force.mean()), "peak_force": float(motion.force.max())}
    return {**task.judge(motion), "duration": float(motion.t[-1]), **forces}


def simulated(config: Any, task: Task, person: Random, again: Random) -> Any:
    """The machine in the hand of a simulated participant; ``person`` draws who, ``again`` which trial it is.

    Args:
        config: of a giant, with its simulation.
        task: that is done.
        person: grip and pace: the same in all trials.
        again: what differs from trial to trial.
    """
    hand = config.simulation.hand
    grip = {"stiffness": person.uniform(*GRIP), "damping": person.uniform(*SLACK)}
    changes: dict[str, Any] = {key: type(getattr(hand, key))(value) for key, value in grip.items()}
    changes |= task.led(hand, person.uniform(*PACE), again)
    simulation = msgspec.structs.replace(
        config.simulation,
        hand=msgspec.structs.replace(hand, **changes),
        seed=again.getrandbits(32),
        touches={},
    )
    return msgspec.structs.replace(config, simulation=simulation)


def _at(moment: Any, t: float) -> Any:
    return msgspec.structs.replace(moment, at=type(moment.at)(t))


def first(times: Array, sign: NDArray[np.bool_]) -> float | None:
    """The first of the times at which something is so."""
    hits = np.flatnonzero(sign)
    return float(times[hits[0]]) if hits.size else None
