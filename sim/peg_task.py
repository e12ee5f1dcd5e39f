"""The task of Bimanual's user study: a bar is to go into a part's hole; and whether it is in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from typing import Final

import numpy as np

from ..configs import read_text
from ..models import Array
from .scene import Scene

PERIOD: Final = 0.01
"""From one look to the next [s]."""
DEPTH, ASIDE, STAYS = 0.025, 3e-3, 0.3
"""The bar is in: so deep below the rim, no further from the hole's axis [m], for so long [s]."""


@dataclass(frozen=True, slots=True)
class Sight:
    """What there is to see.

    Attributes:
        palms: of the avatar, (2, 3) [m].
        bar: its end; hole: the middle of its rim, (3,) [m].
        opening: between each hand's jaws [m].
    """

    palms: Array
    bar: Array
    hole: Array
    opening: Sequence[float]


class PegTask:
    """The scene of configs/peg.xml, and how far the task has come.

    Attributes:
        scene: see ``hapticd.sim.scene``.
        seconds: since the first look.
        success: whether the bar has been in; took: until then [s]. Nobody takes that back.
    """

    def __init__(self) -> None:
        """At rest.

        Raises:
            SceneError: MuJoCo is not installed.
        """
        self.scene = Scene(read_text("peg.xml"), ("left", "right"))
        self.seconds, self.took, self.success, self._stays = 0.0, 0.0, False, 0.0

    def look(self) -> Sight:
        """What is to be seen, without any error; once a period."""
        self.seconds += PERIOD
        deep, aside = self.inserted
        self._stays = self._stays + PERIOD if deep > DEPTH and aside < ASIDE else 0.0
        if not self.success and self._stays > STAYS:
            self.success, self.took = True, self.seconds
        scene = self.scene
        palms = np.array([scene.position("left"), scene.position("right")])
        return Sight(palms, scene.position("bar"), scene.position("part"), scene.opening)

    @property
    def inserted(self) -> tuple[float, float]:
        """How deep the bar's end is below the part's rim, and how far from the hole's axis [m]."""
        scene = self.scene
        x, y, z = (scene.rotation("part").T @ (scene.position("bar") - scene.position("part"))).tolist()
        return -z, hypot(x, y)
