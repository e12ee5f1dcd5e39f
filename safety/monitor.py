"""Watches what comes in: freshness, devices, people, limits, solver, timing (docs/fault-matrix.md, L2)."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from operator import le

from .verdict import PASS, Reaction, Verdict, strongest

WINDOW = 100
"""Ticks over which sporadic faults are counted."""
SPORADIC = 5
"""Sporadic faults in a window that stop the machine (rows 4 and 19)."""
MISSED_HOLD = 5
"""Consecutive frames of one device missing (row 2)."""
SILENCE_S = 20e-3
"""Silence of one device, its dead-man signal included, that counts as its loss (rows 3 and 15)."""
SKIPPED_IN_A_ROW = 3
"""Skipped ticks at once that stop the machine where overruns stop it (row 19)."""
STALL_S = 20e-3
"""A gap after which every drive's watchdog has acted (row 20)."""
SOLVE_HOLD, SOLVE_RAMP = 3, 10
"""Failed solves in a row (row 17)."""
FADE_S = 20e-3
"""Without a valid wrench, faded out meanwhile, or acceleration before the machine stops (row 12)."""
LIMIT_TICKS = 3
"""Ticks past a hard limit before the machine stops (row 25)."""


@dataclass(frozen=True, slots=True)
class Thresholds:
    """What the monitor compares with.

    Attributes:
        axes: names of the axes.
        lower, upper: hard position limits, infinite where there is none [rad or m].
        speed: largest measured speeds [rad/s or m/s].
        devices: names of the devices, in the order of ``Observation.missed``.
        rate: ticks a second.
        overruns_stop: whether skipped ticks stop the machine (a real bus) or are only recorded.
    """

    axes: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    speed: tuple[float, ...]
    devices: tuple[str, ...]
    rate: float
    overruns_stop: bool

    def ticks(self, seconds: float) -> int:
        """How many ticks a time takes, at least one."""
        return max(1, round(seconds * self.rate))


@dataclass(slots=True)
class Observation:
    """What one tick saw; plain numbers, filled anew by the caller each tick.

    Attributes:
        skipped: ticks that did not run before this one.
        missed: consecutive ticks without a fresh frame, one a device.
        discarded: faults of this tick by stale, duplicate or reordered frames: one, however many frames.
        foreign: frames of this tick that only a master may send.
        faults: per device, 0 or its error code.
        lost: per device, whether it restarted or left OP while it should run.
        position, velocity: measured, one an axis.
        armed: whether the drives are meant to run.
        dead_man, e_stop: state of the two-channel inputs; ``dead_man`` False where channels disagree.
        field_clear: whether the scanned field is free of people.
        sto: whether the safety PLC reports that torque is off.
        wrench: of the operator as measured (6), None where a sensor it needs reports an error.
        inertial: whether the accelerometers that move the machine give valid values.
        solved: whether the solver gave an answer it stands by.
    """

    skipped: int = 0
    missed: Sequence[int] = ()
    discarded: int = 0
    foreign: int = 0
    faults: Sequence[int] = ()
    lost: Sequence[bool] = ()
    position: Sequence[float] = ()
    velocity: Sequence[float] = ()
    armed: bool = False
    dead_man: bool = False
    e_stop: bool = True
    field_clear: bool = False
    sto: bool = True
    wrench: Sequence[float] | None = None
    inertial: bool = False
    solved: bool = True


@dataclass(slots=True)
class _Window:
    """Faults of the last WINDOW ticks."""

    marks: deque[int] = field(default_factory=lambda: deque(maxlen=WINDOW))
    total: int = 0

    def push(self, count: int) -> int:
        if len(self.marks) == WINDOW:
            self.total -= self.marks[0]
        self.marks.append(count)
        self.total += count
        return self.total


class Monitor:
    """Judges one observation a tick; total, never raises.

    Attributes:
        wrench_gain: 1 with a valid wrench, fading to 0 within FADE_S without (row 12).
    """

    def __init__(self, thresholds: Thresholds) -> None:
        self._t = thresholds
        self._silence, self._stall = thresholds.ticks(SILENCE_S), thresholds.ticks(STALL_S)
        self._fade = thresholds.ticks(FADE_S)
        self._discards, self._skips = _Window(), _Window()
        self._unsolved = 0
        self._wrench_lost = self._inertial_lost = 0
        self._beyond = 0
        self.wrench_gain = 1.0

    def judge(self, seen: Observation) -> Verdict:
        """The strongest of what the single checks say."""
        verdict = PASS
        for check in (
            self._people,
            self._devices,
            self._frames,
            self._limits,
            self._wrench,
            self._inertial,
            self._solver,
            self._punctuality,
        ):
            verdict = strongest(verdict, check(seen))
        return verdict

    def _people(self, seen: Observation) -> Verdict:
        if seen.e_stop:
            return Verdict(Reaction.OFF, "e_stop", "the emergency stop is pressed")
        if seen.armed and seen.sto:
            return Verdict(Reaction.OFF, "sto", "the safety PLC switched the torque off")
        if seen.armed and not seen.dead_man:
            return Verdict(Reaction.RAMP, "dead_man", "the dead-man switch is open")
        if seen.armed and not seen.field_clear:
            return Verdict(Reaction.RAMP, "scanner", "somebody entered the scanned field")
        return PASS

    def _devices(self, seen: Observation) -> Verdict:
        if any(seen.faults):
            name, code = next(fault for fault in zip(self._t.devices, seen.faults, strict=True) if fault[1])
            return Verdict(Reaction.RAMP, "device_fault", f"{name} reports error {code:#06x}")
        if seen.armed and True in seen.lost:
            name = self._t.devices[list(seen.lost).index(True)]
            return Verdict(Reaction.RAMP, "device_state", f"{name} restarted or left its operating state")
        return PASS

    def _frames(self, seen: Observation) -> Verdict:
        verdict = PASS
        worst = max(seen.missed, default=0)
        if worst:
            name = self._t.devices[list(seen.missed).index(worst)]
            detail = f"{worst} frames of {name} missing in a row"
            if worst >= self._silence:
                verdict = Verdict(Reaction.RAMP, "device_silent", detail)
            elif worst >= MISSED_HOLD:
                verdict = Verdict(Reaction.HOLD, "device_silent", detail)
            else:
                verdict = Verdict(Reaction.SANITISE, "frame_missing", detail)
        if seen.foreign:
            verdict = strongest(
                verdict,
                Verdict(Reaction.RAMP, "second_master", f"{seen.foreign} frames that only a master sends"),
            )
        discarded = self._discards.push(seen.discarded)
        if discarded > SPORADIC:
            detail = f"{discarded} ticks with stale or repeated frames within {WINDOW} ticks"
            verdict = strongest(verdict, Verdict(Reaction.HOLD, "stale_frames", detail))
        elif seen.discarded:
            verdict = strongest(
                verdict, Verdict(Reaction.SANITISE, "frame_discarded", "stale or repeated frames")
            )
        return verdict

    def _limits(self, seen: Observation) -> Verdict:
        t = self._t
        if self._inside(seen):
            self._beyond = 0
            return PASS
        self._beyond += 1
        axes = zip(t.axes, seen.position, seen.velocity, t.lower, t.upper, t.speed, strict=True)
        for name, q, qd, lower, upper, speed in axes:
            if lower <= q <= upper and abs(qd) <= speed:
                continue
            detail = f"{name} at {q:g} with {qd:g} per second; allowed {lower:g} to {upper:g}, {speed:g}"
            if self._beyond >= LIMIT_TICKS and seen.armed:
                return Verdict(Reaction.RAMP, "beyond_limit", detail)
            return Verdict(Reaction.RECORD, "near_limit", detail)
        return PASS

    def _inside(self, seen: Observation) -> bool:
        """Whether every axis is within its limits; a NaN is not."""
        t = self._t
        return (
            all(map(le, t.lower, seen.position))
            and all(map(le, seen.position, t.upper))
            and all(map(le, map(abs, seen.velocity), t.speed))
        )

    def _wrench(self, seen: Observation) -> Verdict:
        if seen.wrench is not None and all(map(isfinite, seen.wrench)):
            self._wrench_lost = 0
            self.wrench_gain = 1.0
            return PASS
        self._wrench_lost += 1
        self.wrench_gain = max(0.0, 1.0 - self._wrench_lost / self._fade)
        return self._lost("wrench", self._wrench_lost, seen.armed)

    def _inertial(self, seen: Observation) -> Verdict:
        if seen.inertial:
            self._inertial_lost = 0
            return PASS
        self._inertial_lost += 1
        return self._lost("acceleration", self._inertial_lost, seen.armed)

    def _lost(self, what: str, ticks: int, armed: bool) -> Verdict:
        detail = f"no valid {what} for {ticks} ticks"
        if ticks > self._fade and armed:
            return Verdict(Reaction.HOLD, f"{what}_lost", detail)
        return Verdict(Reaction.SANITISE, f"{what}_invalid", detail)

    def _solver(self, seen: Observation) -> Verdict:
        if seen.solved:
            self._unsolved = 0
            return PASS
        self._unsolved += 1
        detail = f"{self._unsolved} failed solves in a row"
        if self._unsolved >= SOLVE_RAMP:
            return Verdict(Reaction.RAMP, "solve_failed", detail)
        if self._unsolved >= SOLVE_HOLD:
            return Verdict(Reaction.HOLD, "solve_failed", detail)
        return Verdict(Reaction.SANITISE, "solve_failed", detail)

    def _punctuality(self, seen: Observation) -> Verdict:
        total = self._skips.push(seen.skipped)
        if not seen.skipped:
            return PASS
        detail = f"{seen.skipped} ticks skipped, {total} within {WINDOW} ticks"
        if not (self._t.overruns_stop and seen.armed):
            return Verdict(Reaction.RECORD, "overrun", detail)
        if seen.skipped >= self._stall:
            return Verdict(Reaction.RAMP, "stall", detail)
        if seen.skipped >= SKIPPED_IN_A_ROW or total > SPORADIC:
            return Verdict(Reaction.HOLD, "overrun", detail)
        return Verdict(Reaction.RECORD, "overrun", detail)
