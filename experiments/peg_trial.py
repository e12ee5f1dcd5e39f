"""One trial of the bimanual task of Bimanual's user study: take a bar and a part, put one into the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..control.clutch import Clutch
from ..models import Array
from ..sim.peg_person import Person
from ..sim.peg_task import PegTask
from .lean_pair import DT, FollowingPair, LeadingArm, leading_pair

LIMIT = 300.0
"""As in the paper [s]."""


class Mode(Enum):
    """Of the user study."""

    FEEDBACK = "exoskeleton with feedback"
    NO_FEEDBACK = "exoskeleton without feedback"
    CONTROLLERS = "hand controllers"


@dataclass(frozen=True, slots=True)
class Trial:
    """What became of one.

    Attributes:
        success: whether the bar was in within the limit.
        time: until then, or until it was given up [s].
        peak: largest force between a hand and its arm [N].
        why: it ended.
    """

    success: bool
    time: float
    peak: float
    why: str


def peg_trial(
    mode: Mode, seed: int, limit: float = LIMIT, watch: Callable[[PegTask, Person], None] = lambda *_: None
) -> Trial:
    """Run one; ``watch`` is called after each tick."""
    task = PegTask()
    scene = task.scene
    avatar = FollowingPair(scene, seed)
    lead: list[LeadingArm] = []

    def felt(i: int) -> Array:
        return -lead[i].limb.arm.hold.wrench[:3]

    first = np.array([arm.position for arm in avatar.arms])
    person = Person(task.look, felt if mode is Mode.FEEDBACK else None, first, seed)
    scene.closed = person.closed
    clutches = [Clutch(1.0) for _ in avatar.arms]
    if mode is not Mode.CONTROLLERS:
        lead += leading_pair(person.courses, 1.0 if mode is Mode.FEEDBACK else 0.0, seed)
    for clutch, arm in zip(clutches, avatar.arms, strict=True):
        clutch.align(arm.position, arm.rotation)
    for k in range(round(limit / DT)):
        if lead:
            exchange(lead, avatar, k * DT, mode is Mode.FEEDBACK)
        else:
            controlled(person, clutches, avatar, k * DT)
        watch(task, person)
        why = "in" if task.success else "dropped" if person.lost else avatar.stopped
        if why:
            return Trial(task.success, task.seconds, scene.peak, why)
    return Trial(False, limit, scene.peak, "out of time")


def exchange(lead: list[LeadingArm], avatar: FollowingPair, t: float, passive: bool) -> None:
    """A tick of both stations: each hears what the other one said a tick ago.

    Passive: the link's energy is bounded. Where nothing is fed back no energy goes to the operator, and none
    comes: the avatar could not press on anything.
    """
    said = [(arm.own.task.palm.position.copy(), arm.own.task.palm.rotation.copy(), arm.sent) for arm in lead]
    for arm, there in zip(lead, avatar.arms, strict=True):
        arm.wrench[:] = there.own.force.wrench
        arm.step(t, there.sent)
    for each, (position, rotation, _) in zip(avatar.arms, said, strict=True):
        each.position[:], each.rotation[:] = position, rotation
    avatar.step([energy if passive else None for *_, energy in said])


def controlled(person: Person, clutches: list[Clutch], avatar: FollowingPair, t: float) -> None:
    """A tick of the avatar by hand controllers: each arm goes along as long as its trigger is held."""
    for i, (clutch, arm) in enumerate(zip(clutches, avatar.arms, strict=True)):
        clutch.update(np.array(person.wish(i, t)[0][:3]), np.eye(3), not person.trigger[i])
        arm.position[:], arm.rotation[:] = clutch.position, clutch.rotation
    avatar.step([None, None])
