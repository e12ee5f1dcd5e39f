"""Sections of a configuration that every machine has."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct

from .quantities import (
    Acceleration,
    Angle,
    Damping,
    Duration,
    Force,
    Frequency,
    Instant,
    Lengths3,
    Stiffness,
    Torque,
)


class Strict(Struct, frozen=True, forbid_unknown_fields=True):
    """Base of all sections: an unknown key is an error."""


Node = Annotated[int, Meta(ge=1, le=127)]
Count = Annotated[int, Meta(ge=1, le=2**32 - 1)]
Seed = Annotated[int, Meta(ge=0)]
Substeps = Annotated[int, Meta(ge=1, le=64)]


class Loop(Strict, frozen=True):
    """Pace of the daemon and its reaction to ticks that come too late.

    ``best_effort`` runs a real machine even where the kernel grants no real time. With ``sync = "bus"`` it
    follows the TIME objects (CiA 301) that a device sends once a period. ``spin`` is how early it wakes to
    wait busily for the deadline; without it, the daemon decides. ``cpu`` binds it to a processor.
    """

    rate: Frequency
    on_overrun: Literal["record", "stop"] = "stop"
    duration: Duration | None = None
    best_effort: bool = False
    sync: Literal["free", "bus"] = "free"
    spin: Instant | None = None
    cpu: Annotated[int, Meta(ge=0, le=4095)] | None = None


class SimulatedBus(Strict, frozen=True, tag_field="kind", tag="simulated"):
    """The simulated plant in its own process, over a Unix socket."""


class SocketCanBus(Strict, frozen=True, tag_field="kind", tag="socketcan"):
    """A Linux CAN FD interface."""

    interface: str


class PythonCanBus(Strict, frozen=True, tag_field="kind", tag="python-can"):
    """Any interface of python-can."""

    interface: str
    channel: str


class Arming(Strict, frozen=True):
    """How the machine gets permission to move, and how gently it starts."""

    by: Literal["dead-man", "command"]
    fade: Duration


class Safety(Strict, frozen=True):
    """Distance behind the controller's limits at which the monitor stops the machine, and its stop time."""

    position_margin: Angle
    stop_time: Duration


class JointDrive(Strict, frozen=True, tag_field="type", tag="joint_drive"):
    """A CiA 402 drive in cyclic synchronous torque mode."""

    node: Node
    counts_per_turn: Count
    gear_ratio: tuple[Count, Count]
    link_counts_per_turn: Count
    rated_torque: Torque


class AxisDrive(Strict, frozen=True, tag_field="type", tag="axis_drive"):
    """A CiA 402 drive in cyclic synchronous velocity mode."""

    node: Node
    counts_per_metre: Count


class ForceTorque(Strict, frozen=True, tag_field="type", tag="force_torque"):
    """A six-axis force-torque sensor with its full scale."""

    node: Node
    force: Force
    torque: Torque


class Imu(Strict, frozen=True, tag_field="type", tag="imu"):
    """Accelerometer, with its full scale, and gyroscope."""

    node: Node
    acceleration: Acceleration


class SafetyPlc(Strict, frozen=True, tag_field="type", tag="safety_plc"):
    """The safety PLC with dead-man, emergency stop and scanner."""

    node: Node


Device = JointDrive | AxisDrive | ForceTorque | Imu | SafetyPlc


class Press(Strict, frozen=True):
    """The dead-man switch changes at a time."""

    at: Instant
    pressed: bool


class Place(Strict, frozen=True):
    """A place of the hand."""

    at: Instant
    position: Lengths3


class Hand(Strict, frozen=True):
    """The simulated operator's hand on a handle that turns freely, and its way."""

    stiffness: Stiffness
    damping: Damping
    force: Force
    dead_man: tuple[Press, ...]
    path: Annotated[tuple[Place, ...], Meta(min_length=2)]


class Simulation(Strict, frozen=True, kw_only=True):
    """What every simulated machine has.

    ``touches`` names limits of the machine that the hand meets on its path, and which end of each.
    """

    seed: Seed
    hand: Hand
    touches: dict[str, Literal["lower", "upper", "both"]] = {}


class Config(Strict, frozen=True, kw_only=True, tag_field="system"):
    """What every machine has; each system adds its own."""

    model: str
    loop: Loop
    bus: SimulatedBus | SocketCanBus | PythonCanBus
    arming: Arming
    safety: Safety
    devices: dict[str, Device]
    simulation: Simulation | None = None
