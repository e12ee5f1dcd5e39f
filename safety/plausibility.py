"""Range, rate, standstill and agreement of measurements, before anything is computed from them.

A value is taken where it lies in its range and is as near to the last one as the fastest motion allows. What
is not taken is overwritten, in place, by the last accepted one, extrapolated by its measured rate: whoever
reads it afterwards sees accepted values only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._plausibility import ffi, lib

FRESH_TICKS = 3
"""A stop steers by measurements that are at most so old."""
FROZEN_TICKS = 20
"""An encoder that stands still for so long while its axis must move is frozen (row 9)."""

Array = NDArray[np.float64]


class Values:
    """Measured values of one kind, (n,).

    Attributes:
        age: ticks since each was accepted, (n,).
        rejected: whether this tick's was not plausible, (n,).
        current: whether all of them are of this tick.
    """

    def __init__(
        self,
        values: Array,
        devices: Sequence[int],
        fresh: NDArray[np.bool_],
        most: Sequence[float],
        step: Sequence[float],
        rate: Array | None = None,
        dt: float = 0.0,
    ) -> None:
        """Bind to the arrays of others that are read where they are.

        Args:
            values: (n,), or (m, k) with n = m k; contiguous, rejected ones are overwritten.
            devices: which device measures each, (n,).
            fresh: which devices answered in this tick.
            most: largest magnitudes, (n,).
            step: largest changes in a tick, (n,).
            rate: their measured rates, (n,), accepted before them [1/s].
            dt: of a tick [s].
        """
        n = values.size
        self.age = np.full(n, lib.PLAUSIBILITY_NEVER, np.int32)
        self.rejected = np.zeros(n, np.bool_)
        self.current = False
        self._keep = (
            fresh,
            _doubles(values.reshape(-1), most, step, np.zeros(n)),
            ffi.NULL if rate is None else ffi.from_buffer("double[]", rate),
            ffi.new("int[]", list(devices)),
        )
        value, most_, step_, accepted = self._keep[1]
        self._core = ffi.new(
            "plausible_values *",
            {
                **{"n": n, "dt": dt, "value": value, "rate": self._keep[2], "device": self._keep[3]},
                **{"fresh": ffi.cast("uint8_t *", fresh.ctypes.data), "stride": fresh.strides[0]},
                **{"most": most_, "step": step_, "accepted": accepted},
                "age": ffi.from_buffer("int32_t[]", self.age),
                "rejected": ffi.from_buffer("uint8_t[]", self.rejected),
            },
        )

    def accept(self, elapsed: int) -> bool:
        """Take or replace the values of a tick, so many ticks after the last one; gives ``current``."""
        self.current = lib.plausible_accept(self._core, elapsed) == 0
        return self.current


class Motion:
    """Encoders of one kind, (n,), and what must move them.

    Attributes:
        frozen: whether one stands still although its axis must move, (n,).
    """

    def __init__(
        self,
        position: Array,
        velocity: Array,
        command: Array,
        opposing: Array | None,
        acting: Sequence[float],
        quantum: Sequence[float],
        reach: Sequence[float],
        dt: float,
    ) -> None:
        """Bind to the arrays of others that are read where they are, (n,) each.

        Args:
            position: by the encoders.
            velocity: of the axes, measured.
            command: what the drives were told: torques or velocities.
            opposing: measured torques that balance the command.
            acting: command less opposing torque beyond which an axis must move.
            quantum: less than this is no motion.
            reach: travel by the measured velocity that an encoder must have seen.
            dt: of a tick [s].
        """
        n = position.size
        self.frozen = np.zeros(n, np.bool_)
        self._keep = _doubles(
            position, velocity, command, acting, quantum, reach, np.full(n, np.inf), np.zeros(n)
        )
        names = ("position", "velocity", "command", "acting", "quantum", "reach", "anchor", "travel")
        self._counters = ffi.new("int32_t[]", n), ffi.new("int32_t[]", n)
        self._opposing = ffi.NULL if opposing is None else ffi.from_buffer("double[]", opposing)
        self._core = ffi.new(
            "plausible_motion *",
            {
                **{"n": n, "limit": FROZEN_TICKS, "dt": dt, "opposing": self._opposing},
                **dict(zip(names, self._keep, strict=True)),
                **dict(zip(("still", "pushed"), self._counters, strict=True)),
                "frozen": ffi.from_buffer("uint8_t[]", self.frozen),
            },
        )

    def fine(self, free: bool) -> bool:
        """Take a tick; ``free`` says whether commands may move the axes. Whether none is frozen."""
        return int(lib.plausible_move(self._core, free)) == 0


class Pairs:
    """Encoders on both sides of springs, or of what does not yield, (n,).

    Attributes:
        mismatched: whether two contradict each other, (n,).
    """

    def __init__(
        self,
        motor: Array,
        link: Array,
        load: Array,
        compliance: Sequence[float],
        tolerance: Sequence[float],
    ) -> None:
        """Bind to the arrays of others that are read where they are, (n,) each.

        Args:
            motor: positions by the encoders at the motors.
            link: by those behind the springs.
            load: measured torques in the springs.
            compliance: of the springs, 0 where nothing yields.
            tolerance: largest difference that is no contradiction.
        """
        self.mismatched = np.zeros(motor.size, np.bool_)
        self._keep = _doubles(motor, link, load, compliance, tolerance)
        names = ("motor", "link", "load", "compliance", "tolerance")
        self._core = ffi.new(
            "plausible_pairs *",
            {
                "n": motor.size,
                **dict(zip(names, self._keep, strict=True)),
                "mismatched": ffi.from_buffer("uint8_t[]", self.mismatched),
            },
        )

    def fine(self) -> bool:
        """Compare those of a tick; whether all agree."""
        return int(lib.plausible_agree(self._core)) == 0


@dataclass(slots=True)
class Axes:
    """A group of axes and what is measured of them.

    Attributes:
        values: of the group, rates first; each has one value an axis.
        motions: its encoders.
        pairs: of them.
    """

    values: Sequence[Values]
    motions: Sequence[Motion]
    pairs: Sequence[Pairs] = ()


@dataclass(slots=True)
class Findings:
    """What was found in a tick, one an axis of all groups in their order; see ``Observation``."""

    rejected: list[bool] = field(default_factory=list)
    mismatched: list[bool] = field(default_factory=list)
    frozen: list[bool] = field(default_factory=list)
    stale: list[bool] = field(default_factory=list)


class Plausibility:
    """All measurements of a machine.

    Attributes:
        findings: of the last tick.
    """

    def __init__(self, groups: Sequence[Axes], sensors: Sequence[Values] = ()) -> None:
        """The groups of axes, and what else is measured."""
        self._groups, self._sensors = groups, sensors
        none = [False] * sum(group.values[0].age.size for group in groups)
        self._calm = self.findings = Findings(none, none, none, none)

    def accept(self, elapsed: int, free: bool) -> None:
        """Take a tick, before anything else reads its measurements.

        Args:
            elapsed: ticks since the last one that was taken, 1 where none was skipped.
            free: whether commands may move the axes: brakes are open.
        """
        fine = True
        for sensor in self._sensors:
            sensor.accept(elapsed)
        for group in self._groups:
            for values in group.values:
                fine &= values.accept(elapsed)
            for motion in group.motions:
                fine &= motion.fine(free)
            for pair in group.pairs:
                fine &= pair.fine()
        self.findings = self._calm if fine else self._find()

    def _find(self) -> Findings:
        found = Findings()
        for group in self._groups:
            found.rejected += _any([values.rejected for values in group.values])
            found.stale += _any([values.age > FRESH_TICKS for values in group.values])
            found.frozen += _any([motion.frozen for motion in group.motions])
            nothing = [np.zeros(group.values[0].age.size, np.bool_)]
            found.mismatched += _any([pair.mismatched for pair in group.pairs] or nothing)
        return found


def _any(marks: Sequence[NDArray[np.bool_]]) -> list[bool]:
    return [bool(mark) for mark in np.logical_or.reduce(marks)]


def _doubles(*arrays: Array | Sequence[float]) -> list[object]:
    """Where C finds them; a sequence is copied, an array shared."""
    return [ffi.from_buffer("double[]", np.ascontiguousarray(array, float)) for array in arrays]
