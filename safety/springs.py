"""Torques of motors beside what their sensors show, and how far the springs behind them yield."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..binding import bind
from ._plausibility import ffi, lib

WINDOW = 10
"""Ticks over which a motor's torque and its sensor's are averaged: noise of speeds, and ripple of gears."""
BLOCK = 20
"""Ticks in a row that must agree before anything is learnt of a spring."""

Array = NDArray[np.float64]


class Bounds(NamedTuple):
    """Compliances between which springs' are, (n,) each [rad/(N m) or m/N]."""

    least: Array
    most: Array


class Balance:
    """Motors in torque mode and the sensors of what reaches their loads, (n,).

    Attributes:
        unbalanced: whether a motor and its sensor contradict each other, (n,).
        agree: whether they agree to half of what is no contradiction, (n,).
    """

    def __init__(
        self,
        command: Array,
        load: Array,
        rate: Array,
        age: NDArray[np.int32],
        rotor: Sequence[float],
        tolerance: Sequence[float],
        doubt: float,
        rub: float,
        dt: float,
    ) -> None:
        """Bind to the arrays of others that are read where they are, (n,) each.

        Args:
            command: torques that the motors were told.
            load: torques that the sensors show.
            rate: speeds of the motors.
            age: ticks since those were measured.
            rotor: inertias of the rotors, as the joints see them.
            tolerance: contradiction that is none.
            doubt: share by which those inertias may be others.
            rub: share of a load that gears may take by friction.
            dt: of a tick [s].
        """
        n, depth = command.size, WINDOW + lib.BALANCE_LATE
        self.unbalanced, self.agree = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
        numbers = {"n": n, "window": WINDOW, "depth": depth, "dt": dt, "doubt": doubt, "rub": rub}
        self.core = ffi.new("torque_balance *", numbers)
        bind(
            lib,
            self.core,
            command=command,
            load=load,
            rate=rate,
            age=age,
            rotor=np.array(rotor, float),
            tolerance=np.array(tolerance, float),
            commands=np.zeros((depth, n)),
            loads=np.zeros((depth, n)),
            rates=np.zeros((depth, n)),
            head=np.zeros(1, np.intc),
            since=np.zeros(n, np.int32),
            agree=self.agree,
            unbalanced=self.unbalanced,
        )

    def fine(self, elapsed: int, free: bool) -> bool:
        """Take a tick, so many after the last; ``free``: commands may move the axes. Whether all agree."""
        return int(lib.balance_torques(self.core, elapsed, free)) == 0


class Springs:
    """Springs behind motors, (n,): bounds of their compliances, which only narrow from start to stop.

    Attributes:
        bounds: of the compliances, (n,) each.
    """

    def __init__(
        self,
        motor: Array,
        link: Array,
        load: Array,
        balance: Balance,
        stiffness: Array,
        doubt: float,
        error: Sequence[float],
        slow: Sequence[float],
        relaxing: float,
        easing: float,
    ) -> None:
        """Bind to the arrays of others that are read where they are, (n,) each.

        Args:
            motor: positions by the encoders at the motors.
            link: by those behind the springs.
            load: measured torques in the springs.
            balance: of the motors: where they do not confirm the load, nothing is learnt.
            stiffness: believed; becomes what the bounds leave of it.
            doubt: share by which it may be another, below 1.
            error: of a measured deflection, that of the torque included.
            slow: change of the torque within BLOCK ticks at which anything is learnt.
            relaxing: ticks by which a deflection may lag behind its torque.
            easing: share of itself by which ``stiffness`` may change in a tick.
        """
        n, believed = stiffness.size, stiffness.copy()
        stiffest, softest = 1.0 / (believed * (1.0 + doubt)), 1.0 / (believed * (1.0 - doubt))
        self.bounds = Bounds(stiffest.copy(), softest.copy())
        self.core = ffi.new("spring_bounds *", {"n": n, "block": BLOCK, "relaxing": relaxing})
        bind(
            lib,
            self.core,
            motor=motor,
            link=link,
            load=load,
            agree=balance.agree,
            error=np.array(error, float),
            slow=np.array(slow, float),
            stiffest=stiffest,
            softest=softest,
            believed=believed,
            step=easing * believed,
            deflection=np.zeros(n),
            count=np.zeros(n, np.int32),
            low=np.zeros(n),
            high=np.zeros(n),
            lower=np.zeros(n),
            upper=np.zeros(n),
            least=self.bounds.least,
            most=self.bounds.most,
            stiffness=stiffness,
        )

    def learn(self, free: bool) -> None:
        """Take a tick; ``free``: commands may move the axes, else everything begins anew."""
        lib.springs_learn(self.core, free)
