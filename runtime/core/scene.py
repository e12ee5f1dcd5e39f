"""What a machine tells those who draw it: how its model stands, who pulls it, what it stays inside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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


@dataclass(frozen=True, slots=True)
class Grip:
    """Where a hand holds the machine.

    Attributes:
        name: for people; "" where there is no other.
        frame: of the model that carries it.
        offset: of the grip in that frame (3,) [m].
        turned: rotation vector of the grip's axes in that frame (3,) [rad].
        own_axes: whether its wrench is given in the grip's axes instead of the base's.
    """

    name: str
    frame: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    own_axes: bool = False


@dataclass(frozen=True, slots=True)
class Strength:
    """What the motors can press with at the first grip, as far as it is drawn.

    Attributes:
        torque: largest of each motor (n,) [N m].
        transmission: rates of the drawn joints by those of the motors, (n, n).
        directions: of the base that forces have, 0 to 2 for x to z.
        demand: of a logged state: the force that is asked for there (3,) [N]; zero where none is.
    """

    torque: tuple[float, ...]
    transmission: tuple[tuple[float, ...], ...]
    directions: tuple[int, ...]
    demand: Callable[[np.void], Sequence[float]]


class MachineScene(Protocol):
    """How a logged state looks in the room; all of it in the model's base frame.

    Attributes:
        parts: what the names of the joints that are drawn begin with; ("",) draws the whole model.
        grips: where hands hold the machine.
        boxes, planes: that stand still.
        strength: of its motors, None where it is not drawn.
    """

    parts: tuple[str, ...]
    grips: tuple[Grip, ...]
    boxes: tuple[Box, ...]
    planes: tuple[Plane, ...]
    strength: Strength | None

    def posture(self, state: np.void) -> Sequence[float]:
        """Measured positions of the joints that are drawn, in the model's order, (nv,) [rad or m]."""

    def wrench(self, state: np.void) -> Sequence[float]:
        """Measured wrenches of the hands on the machine at the grips, (6 grips,) [N, N m]."""

    def twin(self, state: np.void) -> Sequence[float] | None:
        """Where what is rendered has the grips, (3 grips,) [m]; None where that has no place."""
