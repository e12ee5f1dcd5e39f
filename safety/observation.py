"""What the monitor sees of a tick, and what it compares with: plain numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Thresholds:
    """What the monitor compares with.

    Attributes:
        axes: names of the axes.
        lower, upper: hard position limits, infinite where there is none [rad or m].
        speed: largest speeds of the axes, nearest to the person [rad/s or m/s].
        motor_speed: largest measured velocities; a motor before a spring may turn a little faster.
        devices: names of the devices, in the order of ``Observation.missed``.
        rate: ticks a second.
        overruns_stop: whether skipped ticks stop the machine (a real bus) or are only recorded.
    """

    axes: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    speed: tuple[float, ...]
    motor_speed: tuple[float, ...]
    devices: tuple[str, ...]
    rate: float
    overruns_stop: bool

    def ticks(self, seconds: float) -> int:
        """How many ticks a time takes, at least one."""
        return max(1, round(seconds * self.rate))


@dataclass(slots=True)
class Observation:
    """What one tick saw; plain numbers, filled anew by the caller each tick.

    What is found of devices or axes may be empty instead, where nothing is found of any.

    Attributes:
        skipped: ticks that did not run before this one.
        missed: consecutive ticks without a fresh frame, one a device.
        discarded: faults of this tick by stale, duplicate or reordered frames: one, however many frames.
        foreign: frames of this tick that only a master may send.
        faults: per device, 0 or its error code.
        lost: per device, whether it restarted or left OP while it should run.
        rejected: per axis, whether a measurement of this tick was not plausible.
        mismatched: per axis, whether its two encoders contradict each other.
        unbalanced: per axis, whether its torque sensor contradicts what its motor gives.
        frozen: per axis, whether an encoder stands still although the axis must move.
        contradicted: per axis, whether its position and its velocity contradict each other.
        stale: per axis, whether its last accepted measurement is too old to brake on.
        astray: per axis, whether it is further from where its controller has it than loads explain.
        overload: axis of which more torque is asked than is rated, now or lately; "" for none.
        ahead: what the machine would have met if it went on, for people; "" for nothing.
        pressed: what a hand pushes together that is held, for people; "" for nothing.
        position, velocity: measured, one an axis.
        way: speed by the way that the encoder nearest to the person went lately, one an axis.
        armed: whether the drives are meant to run.
        dead_man, e_stop: state of the two-channel inputs; ``dead_man`` False where channels disagree.
        field_clear: whether the scanned field is free of people.
        supervised: whether the safety operator holds the other dead-man switch, or none is asked for.
        overriding: whether the machine may move without a hand at its dead-man switch.
        guarded: whether nobody may be in the scanned field.
        sto: whether the safety PLC reports that torque is off.
        wrench: of the operator as measured (6), None where a sensor it needs gives nothing valid.
        inertial: whether the accelerometers that move the machine give valid values.
        solved: whether the solver gave an answer it stands by.
    """

    skipped: int = 0
    missed: Sequence[int] = ()
    discarded: int = 0
    foreign: int = 0
    faults: Sequence[int] = ()
    lost: Sequence[bool] = ()
    rejected: Sequence[bool] = ()
    mismatched: Sequence[bool] = ()
    unbalanced: Sequence[bool] = ()
    frozen: Sequence[bool] = ()
    contradicted: Sequence[bool] = ()
    stale: Sequence[bool] = ()
    astray: Sequence[bool] = ()
    overload: str = ""
    ahead: str = ""
    pressed: str = ""
    position: Sequence[float] = ()
    velocity: Sequence[float] = ()
    way: Sequence[float] = ()
    armed: bool = False
    dead_man: bool = False
    e_stop: bool = True
    field_clear: bool = False
    supervised: bool = False
    overriding: bool = False
    guarded: bool = True
    sto: bool = True
    wrench: Sequence[float] | None = None
    inertial: bool = False
    solved: bool = True
