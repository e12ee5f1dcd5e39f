"""Head and foot of the operator: what is measured of them goes to the avatar."""

from __future__ import annotations

import numpy as np

from ...devices.foot_paddle import FootPaddles
from ...devices.force_torque import READY
from ...devices.head_tracker import HeadTrackers
from ...devices.image import ProcessImage
from ...devices.remote import ENGAGED, WAITING, packed
from ...devices.remote_body import RemoteBodies


class OperatorBody:
    """Between process image and gate.

    Attributes:
        head: pose that was measured last, (7,) [m]; paddle: (3,) shares of its way.
    """

    def __init__(self, image: ProcessImage) -> None:
        self._trackers, self._paddles, self._remote = (
            HeadTrackers(image),
            FootPaddles(image),
            RemoteBodies(image),
        )
        self._head, self._paddle = image["body.head"], image["body.paddle"]
        self.head, self.paddle = self._head[0], self._paddle[0]

    def say(self, leads: bool, act: int) -> None:
        """Where the head is, what the foot does, and whether that is to be followed; ``act`` is the last."""
        seen = self._trackers.pose[0]
        sees = self._trackers.status.item(0) == READY and bool(np.isfinite(seen).all())
        if sees:
            self.head[:] = seen
        trod = self._paddles.status.item(0) == READY
        self.paddle[:] = self._paddles.axes[0] if trod else 0.0
        self._remote.own_flags[0] = packed(ENGAGED if leads and sees else WAITING, act)
