"""Sections of a configuration that every machine has."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta, field

from ...configs.quantities import (
    BitRate,
    Duration,
    Fade,
    Frequency,
    HandDamping,
    HandForce,
    HandStiffness,
    Instant,
    Lengths3,
    SessionTime,
    StopMargin,
)
from ...configs.strict import Strict
from ...sim.sensors import Sensors

Seed = Annotated[int, Meta(ge=0, le=2**53, description="a whole number")]
Substeps = Annotated[int, Meta(ge=1, le=64, description="more would not keep up with real time")]
Name = Annotated[
    str,
    Meta(
        pattern=r"^[^\x00-\x1f\x7f-\x9f]{1,100}$",
        description='write words in quotes, "like these", 1 to 100 characters that print',
    ),
]


class Loop(Strict, frozen=True):
    """Pace of the daemon and its reaction to ticks that come too late.

    ``best_effort`` runs a real machine even where the kernel grants no real time. With ``sync = "bus"`` it
    follows the TIME objects (CiA 301) that a device sends once a period. ``spin`` is how early it wakes to
    wait busily for the deadline; without it, the daemon decides. ``cpu`` binds it to a processor.
    """

    rate: Frequency
    on_overrun: Literal["record", "stop"] = "stop"
    duration: SessionTime | None = None
    best_effort: bool = False
    sync: Literal["free", "bus"] = "free"
    spin: Instant | None = None
    cpu: Annotated[int, Meta(ge=0, le=4095, description="Linux knows no more")] | None = None


class SimulatedBus(Strict, frozen=True, tag_field="kind", tag="simulated"):
    """The simulated plant in its own process, over a Unix socket."""


class SocketCanBus(Strict, frozen=True, tag_field="kind", tag="socketcan"):
    """A Linux CAN FD interface; ``ip link`` sets its bit rates, those given here are compared with them."""

    interface: str
    bitrate: BitRate | None = None
    data_bitrate: BitRate | None = None

    @property
    def name(self) -> str:
        """For people."""
        return self.interface


class PythonCanBus(Strict, frozen=True, tag_field="kind", tag="python-can"):
    """Any interface of python-can that carries CAN FD; ``settings`` are handed to it as they are."""

    interface: str
    channel: str | Annotated[int, Meta(ge=0, le=65535, description="a number of a channel or a port")]
    bitrate: BitRate | None = None
    data_bitrate: BitRate | None = None
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.interface}:{self.channel}"


Bus = SimulatedBus | SocketCanBus | PythonCanBus


class Arming(Strict, frozen=True):
    """How the machine gets permission to move, and how gently it starts.

    ``scanner``: when it is asked: while nobody needs to hold the handle, or always.
    """

    by: Literal["dead-man", "command", "supervisor"]
    fade: Fade
    scanner: Literal["override", "always"] = "override"


class Safety(Strict, frozen=True):
    """Distance behind the controller's limits at which the monitor stops the machine, and its stop time."""

    position_margin: StopMargin
    stop_time: Duration


class Press(Strict, frozen=True):
    """A dead-man switch changes at a time."""

    at: Instant
    pressed: bool


class Place(Strict, frozen=True):
    """A place of the hand."""

    at: Instant
    position: Lengths3


class Hand(Strict, frozen=True):
    """The simulated operator's hand on a handle that turns freely, and its way."""

    stiffness: HandStiffness
    damping: HandDamping
    force: HandForce
    dead_man: Annotated[tuple[Press, ...], Meta(max_length=1000)]
    path: Annotated[tuple[Place, ...], Meta(min_length=2, max_length=5000)]


class Simulation(Strict, frozen=True, kw_only=True):
    """What every simulated machine has.

    ``supervisor`` is what the safety operator does with the dead-man switch of their own. ``touches`` names
    limits of the machine that the hand meets on its path, and which end of each.
    """

    seed: Seed
    hand: Hand
    sensors: Sensors | None = None
    supervisor: Annotated[tuple[Press, ...], Meta(max_length=1000)] | None = None
    touches: dict[str, Literal["lower", "upper", "both"]] = field(default_factory=dict)


class Config(Strict, frozen=True, kw_only=True, tag_field="system"):
    """What every machine has; each system adds its own."""

    model: Name
    loop: Loop
    bus: Bus
    arming: Arming
    safety: Safety
    devices: dict[str, Any]  # of Device; which kinds there are is known only where they are installed
    simulation: Simulation | None = None

    @property
    def plant_time(self) -> bool:
        """Whether a stalled host makes a session longer, as its simulated plant stands still meanwhile."""
        return isinstance(self.bus, SimulatedBus) and self.loop.on_overrun == "record"

    @property
    def twin_names(self) -> tuple[str, ...]:
        """Names of the digital twins that a session may render, the one that it begins with first."""
        return ()
