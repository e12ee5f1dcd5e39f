"""What a machine tells those who draw it: how its model stands, who pulls it, what it stays inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True, slots=True)
class Box:
    """A region of the room that something stays inside.

    Attributes:
        name: of what stays inside, for people.
        lower, upper: corners in the base frame (3,) [m]; infinite where it is open.
    """

    name: str
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Plane:
    """A rendered wall.

    Attributes:
        name: for people.
        point: of the plane, in the base frame (3,) [m].
        normal: unit vector into the wall (3,).
    """

    name: str
    point: tuple[float, float, float]
    normal: tuple[float, float, float]


class MachineScene(Protocol):
    """How a logged state looks in the room; all of it in the model's base frame.

    Attributes:
        handle: frame of the model that the hand holds.
        boxes, planes: that stand still.
    """

    handle: str
    boxes: tuple[Box, ...]
    planes: tuple[Plane, ...]

    def posture(self, state: np.void) -> Sequence[float]:
        """Measured positions of the model's joints, in its order, (nv,) [rad or m]."""

    def wrench(self, state: np.void) -> Sequence[float]:
        """Measured wrench of the hand on the machine at the handle, (6,) [N, N m]."""

    def twin(self, state: np.void) -> Sequence[float] | None:
        """Where the rendered twin has the handle, (3,) [m]; None for a machine without one."""
