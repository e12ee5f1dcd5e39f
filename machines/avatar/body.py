"""Neck and base of the avatar: they go where the operator's head and foot say, and stop where nobody does."""

from __future__ import annotations

import numpy as np

from ...control.base import Base, BaseLimits
from ...control.lease import Lease
from ...control.neck import Neck, NeckLimits
from ...devices.base_drive import BaseDrives
from ...devices.image import ProcessImage
from ...devices.neck_arm import NeckArms
from ...devices.remote import ENGAGED, WAITING, packed, unpacked
from ...devices.remote_pilot import RemotePilots
from ...runtime.core.machine import Equipment
from ...safety import SetPoint
from .config import Body as Section
from .hand import SLACK

AXES = ("x", "y", "z")


class AvatarBody:
    """Between process image and gate.

    Attributes:
        equipment: what the gate needs of neck and base.
        lease: of both.
        wanted: target of the neck from its middle, and speed of the base, (9,).
    """

    def __init__(self, section: Section, delay: float, image: ProcessImage, tick: float, dt: float) -> None:
        """Bind to the image; longest delay of the link, period of the bus and of updates [s]."""
        n, b = section.neck, section.base
        limits = NeckLimits(np.array(n.reach), np.array(n.turn), n.speed, n.rate, n.acceleration, n.turning)
        self.neck = Neck(limits, dt)
        self.base = Base(BaseLimits(b.speed, b.rate, b.acceleration, b.turning, b.dead_zone), dt)
        ways: list[tuple[str, float, float]] = [("moves along", most, n.speed) for most in n.reach]
        ways += [("turns about", most, n.rate) for most in n.turn]
        neck = tuple(
            SetPoint(f"neck, as it {what} {axis}", -most, most, SLACK * speed * dt)
            for (what, most, speed), axis in zip(ways, AXES * 2, strict=True)
        )
        speeds = [(b.speed, b.acceleration)] * 2 + [(b.rate, b.turning)]
        base = tuple(
            SetPoint(f"speed of the base {axis}", -most, most, SLACK * rise * dt, rest=0.0)
            for axis, (most, rise) in zip(("forward", "to the left", "about"), speeds, strict=True)
        )
        self.equipment = (
            Equipment("neck", 0, "target", "way", neck),
            Equipment("base", 0, "target", "speed", base),
        )
        self.lease = Lease(delay, tick)
        self._pilot, self._necks, self._bases = RemotePilots(image), NeckArms(image), BaseDrives(image)
        self._way, self._speed = image["pilot.way"], image["pilot.speed"]
        self._act, self._led = 0, False
        self.wanted = np.zeros(9)

    def hear(self) -> None:
        """What the operator's station says."""
        pilot = self._pilot
        flags, act = unpacked(pilot.flags.item(0))
        self.lease.update(pilot.age.item(0), True, bool(flags & ENGAGED), act)

    def say(self) -> None:
        """What is measured."""
        self._way[0], self._speed[0] = self._necks.way[0], self._bases.speed[0]
        flags = ENGAGED if self.lease.follows else WAITING
        self._pilot.own_flags[0] = packed(flags, self._act)

    def engage(self) -> None:
        """The neck is held where it is, the base stands."""
        self.neck.reset(self._necks.way[0])
        self.base.reset()
        self._take()

    def restart(self) -> None:
        """The avatar was started again: the operator must act anew."""
        if self._led:
            self.lease.bar()

    def update(self, permitted: bool, safe: bool) -> None:
        """Follow head and foot.

        Args:
            permitted: whether the station lets anything follow.
            safe: whether the base may move, too: no arm has stopped itself.
        """
        follows = permitted and self.lease.follows
        self._led |= follows
        _, act = unpacked(self._pilot.flags.item(0))
        head = self._pilot.head[0]
        new = act != self._act
        if follows and not new:
            self.neck.resume()
        else:
            self.neck.stop()
        self.neck.update(head[:3], head[3:])
        if follows and new:
            self.neck.recentre()
            self._act = act
        self.base.update(self._pilot.paddle[0], follows and safe)
        self._take()

    def _take(self) -> None:
        self.wanted[:3], self.wanted[3:6] = self.neck.position, self.neck.rotation
        self.wanted[6:] = self.base.velocity
