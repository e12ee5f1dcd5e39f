"""A serial arm as it is understood, whatever file it is from."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

from ...models import Array

MOVING = ("revolute", "continuous", "prismatic")
HANDLE, SENSOR = "handle", "force_torque"
GRIP_LENGTH, GRIP_RADIUS = 0.1, 0.016
"""Size of the handle that is put on the tip [m]."""


@dataclass(frozen=True, slots=True)
class Body:
    """Mass [kg], centre (3,) [m] and inertia about it (3, 3) [kg m^2], in the frame of the link."""

    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint as it is understood.

    Attributes:
        name, kind, parent, child: as written; the kind becomes "fixed" where the joint is frozen.
        xyz, rpy: its place.
        axis: unit vector.
        lower, upper: infinite where there is no limit.
        effort, velocity: 0 where the file says nothing.
        damping: viscous friction.
        follows: the joint that it follows; "" for none.
        written: its name in the file, whatever it is called here.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz: tuple[float, ...]
    rpy: tuple[float, ...]
    axis: tuple[float, ...] = (1.0, 0.0, 0.0)
    lower: float = -inf
    upper: float = inf
    effort: float = 0.0
    velocity: float = 0.0
    damping: float = 0.0
    follows: str = ""
    written: str = ""

    @property
    def moves(self) -> bool:
        """Whether a motor may move it."""
        return self.kind in MOVING and not self.follows and self.lower < self.upper


@dataclass(frozen=True, slots=True)
class Primitive:
    """A collision shape of a link: what the URDF calls it, its numbers by their names, and its place."""

    kind: str
    numbers: dict[str, tuple[float, ...]]
    xyz: tuple[float, ...]
    rpy: tuple[float, ...]


@dataclass(slots=True)
class Description:
    """A serial arm.

    Attributes:
        name: of the robot.
        joints: that move, from base to tip, by their names.
        links: bodies of the links, by their names; None where one is a mere frame.
        frozen: fixed joints.
        shapes: for collisions, of links that have any.
        handle: mass of the handle that is put on the tip [kg].
        remarks: what was left out, frozen, mended or guessed, a sentence each.
        source: name of the file.
    """

    name: str
    joints: dict[str, Joint]
    links: dict[str, Body | None]
    frozen: list[Joint]
    shapes: dict[str, list[Primitive]] = field(default_factory=dict)
    handle: float = 0.3
    remarks: list[str] = field(default_factory=list)
    source: str = ""
