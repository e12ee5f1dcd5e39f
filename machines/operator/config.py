"""Sections of an operator station's configuration."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, field

from ...configs.quantities import CueForce, Duration
from ...configs.strict import Strict
from ...devices.remote import MOST_DRIVES
from ...runtime.core.sections import Config, Name
from ..telemanipulation.sections import FarArms, Gain, Pushed, Station, StationSimulation

Drives = Annotated[tuple[Name, ...], Meta(min_length=1, max_length=MOST_DRIVES)]
Scale = Annotated[float, Meta(ge=0.05, le=5.0, description="of the avatar's motion to the hand's")]


class Foreseen(FarArms, frozen=True):
    """The arms that this station foresees, and their lag."""

    lag: Duration


class Gloves(Strict, frozen=True):
    """The drives of the avatar's hands, as they report their currents: a finger feels those with its name."""

    left: Drives
    right: Drives


class Announced(Strict, frozen=True):
    """How strongly the hand is told that something intervenes, 0 for not at all."""

    force: CueForce = CueForce(2.0)


class Operator(Station, frozen=True, kw_only=True):
    """What the controller of the operator station needs.

    Without ``avatar`` it foresees nothing, without ``gloves`` it has none; ``body`` says whether it has
    a tracker of the head and a foot paddle. ``assist`` is the gain of the hand's wrench, ``feedback`` that of
    the avatar's, ``scale`` the avatar's way for that of the hand.
    """

    assist: Gain = 1.0
    feedback: Gain = 1.0
    scale: Scale = 1.0
    avatar: Foreseen | None = None
    gloves: Gloves | None = None
    body: bool = False
    cue: Announced = field(default_factory=Announced)


class OperatorSimulation(StationSimulation, frozen=True, kw_only=True):
    """The simulated operator."""

    buttons: Annotated[tuple[Pushed, ...], Meta(max_length=1000)] | None = None


class OperatorConfig(Config, frozen=True, kw_only=True, tag="operator"):
    """An operator station."""

    operator: Operator
    simulation: OperatorSimulation | None = None
