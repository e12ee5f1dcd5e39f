"""Range, rate, standstill and agreement of measurements, before anything is computed from them.

A value is taken where it lies in its range and is as near to the last one as the fastest motion allows, or
where its measured rate says that it would be: what is faster than it may be, and says so, is motion. What
is not taken is overwritten, in place, by the last accepted one, extrapolated by its measured rate: whoever
reads it afterwards sees accepted values only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..binding import bind, pointer
from ._plausibility import ffi, lib
from .heat import Heat
from .springs import Balance, Bounds, Springs

FRESH_TICKS = 3
"""A stop steers by measurements that are at most so old."""
FROZEN_TICKS = 20
"""An encoder that stands still for so long while its axis must move is frozen (row 9)."""

CONTRADICTED_TICKS = 3
"""Position and velocity that contradict each other for so long: one wrong sample does for one (row 9)."""

Array = NDArray[np.float64]


class Values:
    """Measured values of one kind, (n,).

    Attributes:
        value: accepted ones, (n,).
        age: ticks since each was accepted, (n,).
        rejected: whether this tick's was not plausible, (n,).
    """

    def __init__(
        self,
        values: Array,
        devices: Sequence[int],
        fresh: NDArray[np.bool_],
        most: Sequence[float],
        step: Sequence[float],
        rate: Values | None = None,
        dt: float = 0.0,
    ) -> None:
        """Bind to the arrays of others that are read where they are.

        Args:
            values: (n,), or (m, k) with n = m k; contiguous, rejected ones are overwritten.
            devices: which device measures each, (n,).
            fresh: which devices answered in this tick.
            most: largest magnitudes, (n,).
            step: largest changes in a tick, (n,).
            rate: their measured rates, (n,), to be accepted before them [1/s].
            dt: of a tick [s].

        Raises:
            BindError: an array of another kind, of which C would see a copy, or nothing.
        """
        n = values.size
        pointer(values, "double", *values.shape, name="values")  # else flattening it would copy it
        self.value = values.reshape(-1)
        self.age = np.full(n, lib.PLAUSIBILITY_NEVER, np.int32)
        self.rejected = np.zeros(n, np.bool_)
        self._still, self._old = ffi.new("int32_t[1]"), ffi.new("int32_t[1]", [1])
        self._core = ffi.new("plausible_values *", {"n": n, "dt": dt, "stride": fresh.strides[0]})
        bind(
            lib,
            self._core,
            value=self.value,
            rate=None if rate is None else rate.value,
            rate_age=None if rate is None else rate.age,
            device=np.array(devices, np.intc),
            fresh=fresh,
            most=np.array(most, float),
            step=np.array(step, float),
            accepted=np.zeros(n),
            age=self.age,
            rejected=self.rejected,
            still=self._still,
            old=self._old,
        )

    @property
    def current(self) -> bool:
        """Whether all of them are of the last tick that was taken."""
        return not self._old[0]

    @property
    def still(self) -> int:
        """How often in a row fresh values came that were all the same: what measures has noise."""
        return int(self._still[0])

    def accept(self, elapsed: int) -> bool:
        """Take or replace the values of a tick, so many ticks after the last one; gives ``current``."""
        return int(lib.plausible_accept(self._core, elapsed)) == 0


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
        spring: tuple[Array, Sequence[float]] | None = None,
        patience: Sequence[int] | None = None,
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
            spring: between what the velocity is of and the encoder: torque in it, and compliance.
            patience: ticks of such a command after which the encoder must have seen it; None: FROZEN_TICKS.
        """
        n = position.size
        load, compliance = spring or (None, None)
        self.frozen = np.zeros(n, np.bool_)
        self._core = ffi.new("plausible_motion *", {"n": n, "limit": FROZEN_TICKS, "dt": dt})
        bind(
            lib,
            self._core,
            position=position,
            velocity=velocity,
            command=command,
            opposing=opposing,
            acting=np.array(acting, float),
            quantum=np.array(quantum, float),
            reach=np.array(reach, float),
            patience=np.array(patience or [FROZEN_TICKS] * n, np.int32),
            load=load,
            compliance=None if compliance is None else np.array(compliance, float),
            anchor=np.full(n, np.inf),
            loaded=np.zeros(n),
            travel=np.zeros(n),
            still=np.zeros(n, np.int32),
            pushed=np.zeros(n, np.int32),
            frozen=self.frozen,
        )

    def fine(self, free: bool) -> bool:
        """Take a tick; ``free`` says whether commands may move the axes. Whether none is frozen."""
        return int(lib.plausible_move(self._core, free)) == 0


class Course:
    """Position and velocity of axes, (n,), compared over a window of ticks.

    Attributes:
        wrong: whether both contradict each other, (n,).
        way: speed by the way within the window, (n,) [1/s].
        speed: that, or the velocity, whichever is larger, (n,) [1/s].
    """

    def __init__(
        self, position: Values, velocity: Values, tolerance: Sequence[float], window: int, dt: float
    ) -> None:
        """Bind to measurements that are accepted before.

        Args:
            position: by the encoders.
            velocity: of the same axes.
            tolerance: by how much they may contradict each other within the window, (n,).
            window: ticks.
            dt: of a tick [s].
        """
        n = position.value.size
        self.wrong, self.speed, self.way = np.zeros(n, np.bool_), np.zeros(n), np.zeros(n)
        self._core = ffi.new(
            "plausible_course *", {"n": n, "window": window, "limit": CONTRADICTED_TICKS, "dt": dt}
        )
        bind(
            lib,
            self._core,
            position=position.value,
            velocity=velocity.value,
            position_age=position.age,
            velocity_age=velocity.age,
            tolerance=np.array(tolerance, float),
            errors=np.zeros((window, n)),
            places=np.zeros((window, n)),
            head=np.zeros(1, np.intc),
            error=np.zeros(n),
            last_position=np.zeros(n),
            last_velocity=np.zeros(n),
            gap=np.full(n, lib.PLAUSIBILITY_NEVER, np.int32),
            apart=np.zeros(n, np.int32),
            wrong=self.wrong,
            speed=self.speed,
            since=np.zeros(n, np.int32),
            way=self.way,
        )

    def show(self, speed: Array, way: Array) -> None:
        """Write speed and way to arrays of somebody else from now on, (n,) each."""
        bind(lib, self._core, speed=speed, way=way)
        self.speed, self.way = speed, way

    def fine(self, elapsed: int) -> bool:
        """Take a tick, so many ticks after the last one; whether no axis contradicts itself."""
        return int(lib.plausible_travel(self._core, elapsed)) == 0


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
        frozen: tuple[Sequence[float], Sequence[float]] | None = None,
        relaxing: float = 0.0,
        bounds: Bounds | None = None,
    ) -> None:
        """Bind to the arrays of others that are read where they are, (n,) each.

        Args:
            motor: positions by the encoders at the motors.
            link: by those behind the springs.
            load: measured torques in the springs.
            compliance: of the springs, 0 where nothing yields.
            tolerance: largest difference that is no contradiction; of a spring that is stiffer than believed,
                less in proportion.
            frozen: changes of the torque that are none, and of the difference that do not come without;
                None where the torque does not act on it.
            relaxing: ticks by which a deflection may lag behind its torque.
            bounds: compliances that the springs may have instead; None for none.
        """
        n = motor.size
        believed = np.array(compliance, float)
        least, most = bounds or (believed, believed)
        self.mismatched = np.zeros(n, np.bool_)
        quantum, reach = frozen or ([np.inf] * n, [np.inf] * n)
        self._core = ffi.new("plausible_pairs *", {"n": n, "relaxing": relaxing})
        bind(
            lib,
            self._core,
            motor=motor,
            link=link,
            load=load,
            compliance=believed,
            least=least,
            most=most,
            tolerance=np.array(tolerance, float),
            quantum=np.array(quantum, float),
            reach=np.array(reach, float),
            deflection=np.zeros(n),
            load_stood=np.full(n, np.nan),
            deflection_stood=np.zeros(n),
            lag_stood=np.zeros(n),
            mismatched=self.mismatched,
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
        courses: of them; the last tells how fast the axes are.
        pairs: of them.
        balances: of their motors and torque sensors.
        springs: behind them.
        heats: budgets of their motors.
    """

    values: Sequence[Values]
    motions: Sequence[Motion]
    courses: Sequence[Course]
    pairs: Sequence[Pairs] = ()
    balances: Sequence[Balance] = ()
    springs: Sequence[Springs] = ()
    heats: Sequence[Heat] = ()


@dataclass(slots=True)
class Findings:
    """What was found in a tick, one an axis of all groups in their order; empty where nothing was.

    See ``Observation``.
    """

    rejected: list[bool] = field(default_factory=list)
    mismatched: list[bool] = field(default_factory=list)
    unbalanced: list[bool] = field(default_factory=list)
    frozen: list[bool] = field(default_factory=list)
    contradicted: list[bool] = field(default_factory=list)
    stale: list[bool] = field(default_factory=list)


class Plausibility:
    """All measurements of a machine.

    Attributes:
        findings: of the last tick.
    """

    def __init__(self, groups: Sequence[Axes], sensors: Sequence[Values] = ()) -> None:
        """The groups of axes, and what else is measured."""
        self._groups = groups
        values = [*sensors, *(values for group in groups for values in group.values)]
        motions = [motion for group in groups for motion in group.motions]
        courses = [course for group in groups for course in group.courses]
        pairs = [pair for group in groups for pair in group.pairs]
        balances = [balance for group in groups for balance in group.balances]
        springs = [spring for group in groups for spring in group.springs]
        self._heats = [heat for group in groups for heat in group.heats]
        # they own what C is pointed to
        self._checks = values, motions, courses, pairs, balances, springs
        self._core = _machine(values, motions, courses, balances, springs, pairs, len(sensors))
        self._speed, self._way = np.zeros((2, sum(group.courses[-1].way.size for group in groups)))
        first = 0
        for course in (group.courses[-1] for group in groups):
            part = slice(first, first := first + course.way.size)
            course.show(self._speed[part], self._way[part])
        self._calm = self.findings = Findings()

    @property
    def speed(self) -> list[float]:
        """Speed of each axis by the encoder nearest to the person: the larger of two, see ``Course``."""
        speed: list[float] = self._speed.tolist()
        return speed

    @property
    def way(self) -> list[float]:
        """Speed of each axis by the way that the encoder nearest to the person went within a window."""
        way: list[float] = self._way.tolist()
        return way

    def accept(self, elapsed: int, free: bool) -> None:
        """Take a tick, before anything else reads its measurements.

        Args:
            elapsed: ticks since the last one that was taken, 1 where none was skipped.
            free: whether commands may move the axes: brakes are open.
        """
        for heat in self._heats:
            heat.take(elapsed)
        found = lib.plausible_tick(self._core, elapsed, free)
        self.findings = self._find() if found else self._calm

    def _find(self) -> Findings:
        found = Findings()
        for group in self._groups:
            found.rejected += _any([values.rejected for values in group.values])
            found.stale += _any([values.age > FRESH_TICKS for values in group.values])
            found.frozen += _any([motion.frozen for motion in group.motions])
            found.contradicted += _any([course.wrong for course in group.courses])
            nothing = [np.zeros(group.values[0].age.size, np.bool_)]
            found.mismatched += _any([pair.mismatched for pair in group.pairs] or nothing)
            found.unbalanced += _any([balance.unbalanced for balance in group.balances] or nothing)
        return found


def _machine(
    values: Sequence[Values],
    motions: Sequence[Motion],
    courses: Sequence[Course],
    balances: Sequence[Balance],
    springs: Sequence[Springs],
    pairs: Sequence[Pairs],
    sensors: int,
) -> Any:
    cores = {
        "values": ffi.new("plausible_values *[]", [each._core for each in values]),
        "motions": ffi.new("plausible_motion *[]", [each._core for each in motions]),
        "courses": ffi.new("plausible_course *[]", [each._core for each in courses]),
        "balances": ffi.new("torque_balance *[]", [each.core for each in balances]),
        "springs": ffi.new("spring_bounds *[]", [each.core for each in springs]),
        "pairs": ffi.new("plausible_pairs *[]", [each._core for each in pairs]),
    }
    counts = {f"{name}_count": len(each) for name, each in cores.items()}
    machine = ffi.new("plausible_machine *", {**counts, "sensors": sensors})
    bind(lib, machine, **cores)
    return machine


def _any(marks: Sequence[NDArray[np.bool_]]) -> list[bool]:
    return [bool(mark) for mark in np.logical_or.reduce(marks)]
