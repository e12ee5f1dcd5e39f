"""Machines whose joints are led, for calibration and identification: nobody holds the handle."""

from __future__ import annotations

from typing import Any, TypeVar

import msgspec

from ...configs.quantities import Duration, Instant
from ...control.way import Way
from ...models import Array
from ...runtime.configuration.system import Course
from ...runtime.core.sections import Arming, Press
from .sections import Away

PACE = 0.4
"""Part of the joints' rated speeds and accelerations on ways: a person stands beside the machine."""
PRESSED = Instant(0.3)
"""When the dead-man switch is pressed [s]."""
C = TypeVar("C", bound=msgspec.Struct)


class LedJoints:
    """What such a machine adds to its controller; see ``Led``. Everything that stops it stops it."""

    _way: Way
    _course: Course

    def rest_at(self, way: Way, q: Array) -> None:
        """Begin at a posture, on a way."""
        way.rest(q)
        self._course = self._way = way

    @property
    def arrived(self) -> bool:
        """See ``Led``."""
        return self._course.arrived

    def go(self, q: Array) -> None:
        """See ``Led``."""
        self.rest_at(self._way, self._course.q.copy())
        self._way.go(q)

    def follow(self, course: Course) -> None:
        """See ``Led``."""
        self._course = course

    def unrest(self, first: bool) -> list[str]:
        """What a sensor shows that is not calibrated says nothing."""
        return []


def let_alone(config: C) -> C:
    """The same machine, which a dead-man switch arms, and whose hand stays away."""
    whole: Any = config
    away = Away(Instant(0.0), Duration(1e6))
    hand = msgspec.structs.replace(whole.simulation.hand, away=(away,), dead_man=(Press(PRESSED, True),))
    return msgspec.structs.replace(
        config,
        arming=Arming("dead-man", whole.arming.fade),
        simulation=msgspec.structs.replace(whole.simulation, hand=hand),
    )
