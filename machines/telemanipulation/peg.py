"""A pair of stations whose scripted person takes a bar and a part, and puts one into the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, cast

import numpy as np

from ...models import Array
from ...runtime.invocation import install
from ...sim.hand import Course
from ...sim.peg_person import Person
from ...sim.peg_task import PegTask
from ...sim.scene import Scene, SceneError
from .pair import Pair, PairError
from .plant import Closes, SimArm

BEGIN_S = 4.6
"""When the person begins: both stations have been armed and faded in by then [s]."""


class Led(Protocol):
    """The plant of an operator's station."""

    arms: list[SimArm]

    def follow(self, courses: Sequence[Course], closing: Closes) -> None:
        """The hands go other ways from now on, and close otherwise."""


class Handed(Protocol):
    """The plant of an avatar."""

    arms: list[SimArm]

    def enter(self, scene: Scene) -> None:
        """The hands are in a scene from now on."""


class Fists:
    """How far a person's hands are closed."""

    def __init__(self, person: Person) -> None:
        self._person = person

    def at(self, time: float) -> list[float]:
        """See ``Closes``."""
        return [float(closed) for closed in self._person.closed]


def set_task(pair: Pair, seed: int) -> PegTask:
    """Give a pair, which has not begun, the scene and the person; the seed is the person's.

    Raises:
        PairError: MuJoCo is not installed.
    """
    try:
        task = PegTask()
    except SceneError as error:
        raise PairError(f"{error}; type: {install('mujoco')}") from error
    leads, follows = cast(Led, pair.operator.plant), cast(Handed, pair.avatar.plant)

    def felt(i: int) -> Array:
        return -leads.arms[i].arm.hold.wrench[:3]

    first = np.array([arm.arm.position for arm in leads.arms])
    person = Person(task.look, felt, first, seed, BEGIN_S)
    leads.follow(person.courses, Fists(person))
    follows.enter(task.scene)
    return task


def told(task: PegTask) -> str:
    """What became of the task, in words."""
    force = f"largest force at a hand {task.scene.peak:.1f} N"
    if task.success:
        return f"the bar is in the part after {task.took:.1f} s; {force}"
    deep, aside = task.inserted
    return (
        f"the bar is not in the part: {-1e3 * deep:.0f} mm above its rim, {1e3 * aside:.0f} mm aside; {force}"
    )


def figures(task: PegTask) -> dict[str, float | bool | None]:
    """The same as plain numbers."""
    took = task.took if task.success else None
    return {"success": task.success, "seconds": took, "largest_force_n": task.scene.peak}
