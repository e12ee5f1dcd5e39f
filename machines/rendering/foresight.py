"""What a machine that renders a twin would meet if it went on (docs/fault-matrix.md, row 26)."""

from __future__ import annotations

from collections.abc import Sequence

from ...control.force_control import Box
from ...control.look_ahead import LookAhead, Room, Stop
from ...models import Array, Robot
from .sections import LookAhead as Section
from .surroundings import watched

REACTION_S = 10e-3
"""Until a stop is felt: a tick to be judged, one for the drives, and what links lag behind their commands."""

PRESSED_SHARE = 0.5
"""Part of the margin that a held machine may be pushed to: brakes hold more than motors."""


class Foresight:
    """Looks ahead, where the configuration says so.

    Attributes:
        ahead: what would be met, for people; "" for nothing.
        pressed: what a hand pushes together that is held, for people; "" for nothing.
    """

    def __init__(
        self,
        section: Section | None,
        robot: Robot,
        limits: tuple[Array, Array],
        q: Array,
        stop: Stop,
        boxes: Sequence[Box] = (),
    ) -> None:
        """See ``LookAhead``; lower and upper limits of the joints, (n,) each [rad or m]; boxes of frames."""
        self.ahead = self.pressed = ""
        pairs = watched(robot, section, limits)[0] if section else []
        rooms = [_room(robot, box) for box in boxes]
        self._look = LookAhead(robot, pairs, section.margin, q, stop, rooms) if section and pairs else None

    def reset(self) -> None:
        """A start: what is near may stay so, and leave."""
        self.ahead = self.pressed = ""
        if self._look:
            self._look.reset()

    def update(self) -> None:
        """One tick, with what was measured in it."""
        met = self._look.update() if self._look else None
        self.ahead = str(met) if met else ""

    def hold(self) -> None:
        """The same of a machine that comes to rest and is held."""
        self.pressed = self._look.pressed(PRESSED_SHARE) if self._look else ""


def _room(robot: Robot, box: Box) -> Room:
    frame = robot.model.frames[robot.frame(box.frame)]
    return Room(int(frame.parentJoint) - 1, frame.placement.translation.copy(), box.lower, box.upper)
