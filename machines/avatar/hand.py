"""A hand of the avatar: it goes where the operator's fingers are, and tells what that takes."""

from __future__ import annotations

import numpy as np

from ...control.hands import Drive, HandLaw, HandMap
from ...control.notice import Notice
from ...devices.image import ProcessImage
from ...devices.remote import ENGAGED, WAITING, unpacked
from ...devices.remote_glove import RemoteGloves
from ...devices.robot_hand import RobotHand, RobotHands
from ...devices.sense_glove import GLOVE_JOINTS
from ...runtime.core.machine import Equipment
from ...safety import SetPoint
from .config import RobotHand as Section

GRASPS_A, LOOSE_A, QUIET_S = 0.35, 0.22, 0.3
"""Current of a drive that holds something, and that of one that does not any more [A], [s]."""
SLACK = 1.05
"""Of the gate above the law's own largest step: it is to catch what is wrong, not what is rounded."""


class AvatarHand:
    """Between process image and gate.

    Attributes:
        equipment: what the gate needs of it.
        current: of its drives, (n,) [A].
        law: of its targets.
    """

    def __init__(self, side: str, section: Section, image: ProcessImage, dt: float) -> None:
        """Find the hand and its glove by their names."""
        network = image.network
        names = [device.name for device in network.devices]
        device = network.devices[names.index(f"{side}_hand")]
        assert isinstance(device, RobotHand)
        self.drives = device.drives
        own = [section.drives[name] for name in self.drives]
        drives = [Drive(each.follows, each.offset, each.lower, each.upper) for each in own]
        self.law = HandLaw(HandMap(GLOVE_JOINTS, drives), section.speed, dt)
        row = _row(image, device.group, f"{side}_hand")
        self._hands, self._gloves = RobotHands(image, device.group), RemoteGloves(image)
        self._row, self._glove = row, _row(image, "remote_gloves", f"{side}_glove")
        self.current, self._position = self._hands.current[row], self._hands.position[row]
        self._angle = self._gloves.angle[self._glove]
        self._told = image["remote_gloves.current"][self._glove]
        step = SLACK * section.speed * dt
        points = (
            SetPoint(f"{name} of the {side} hand", each.lower, each.upper, step)
            for name, each in zip(self.drives, own, strict=True)
        )
        self.equipment = Equipment(device.group, row, "target", "position", tuple(points))
        self._grasps = Notice(GRASPS_A, LOOSE_A, round(QUIET_S / dt))
        self._side, self._follows = side, False

    def engage(self) -> None:
        """It stays where it is."""
        self.law.reset(self._position)

    def say(self) -> None:
        """What its motors take."""
        self._told[: len(self.current)] = self.current
        self._gloves.own_flags[self._glove] = ENGAGED if self._follows else WAITING

    def update(self, share: float, most_age: float) -> str:
        """Follow the glove with a share of its speed; what people are told, "" where nothing is new.

        Args:
            share: 0 to 1; 0 while its arm does not follow.
            most_age: of what may move it [s].
        """
        gloves, glove = self._gloves, self._glove
        flags, _ = unpacked(gloves.flags.item(glove))
        ready = self._hands.ready(self._row)
        self._follows = share > 0.0 and ready and bool(flags & ENGAGED) and gloves.age.item(glove) <= most_age
        if self._follows:
            self.law.update(self._angle, share)
        if self._grasps.update(float(np.abs(self.current).max())):
            held = [name for name, i in zip(self.drives, self.current, strict=True) if i >= LOOSE_A]
            return f"{self._side} hand grasps: {', '.join(held)}"
        return ""

    @property
    def grasping(self) -> int:
        """How many of its drives hold something."""
        return int(np.count_nonzero(self.current >= LOOSE_A))


def _row(image: ProcessImage, group: str, name: str) -> int:
    """Which of a group a device is."""
    network = image.network
    return [network.devices[i].name for i in network.groups[group]].index(name)
