"""The last code before bytes leave: an output goes out only if the gate admitted it.

Deny by default. The gate holds the outputs of the drives and nobody else writes them; a command that is not
admitted is replaced by a weaker one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..binding import bind
from ._plausibility import ffi, lib
from .heat import ADMITTED, Heat, Peak
from .tally import WINDOW, Rule, Tally
from .verdict import OUTPUT_BEYOND_LIMIT, PASS, Reaction, Verdict

Array = NDArray[np.float64]

CLAMPS_BEFORE_HOLD, CLAMPED_HOLD_S = 10, 0.01
"""Ticks in a row with commands beyond a limit, and how long they take together, before the machine stops
(docs/fault-matrix.md, row 24): a motor that gives all it has for some milliseconds does so at every rate,
and at slow rates a few ticks are no habit."""
CLAMPED_RAMP_S, CLAMPED_OFF_S = 0.1, 0.15
"""Commands beyond a limit for so long lead to more. Braking as hard as the torque allows is such a command,
too, for some 50 ms; a stop that goes on like that is none."""
OFTEN, OFTEN_WINDOW = 2, 10
"""The first of these stops, too, where it comes to so many times as much within so many times as long, the
others within OFTEN times as long: a command that is good now and then is no good command. The built-in
sessions clamp 4 ticks in all."""
LOST_BEFORE_OFF = 3
"""Ticks in a row with commands that are no numbers before the torque goes off: there is no ramp without. As
many within a window lead to a ramp: a controller that computes such commands is broken."""
NO_NUMBER: Final = lib.GATE_NO_NUMBER


@dataclass(frozen=True, slots=True)
class AxisLimits:
    """What an axis may be commanded, in units of its command (N m for torque, m/s for velocity axes).

    Attributes:
        name: of the axis.
        command: largest magnitude, of a motor that may give more for a time the one for ever.
        step: largest change from one tick to the next, infinite where the drive limits it.
        power: largest command times measured speed along it, infinite where it is no torque [W].
        lower, upper: measured positions at which commands further out are neutralised [rad or m].
        peak: what it may be commanded for a time; None where that is no more.
    """

    name: str
    command: float
    step: float
    power: float
    lower: float
    upper: float
    peak: Peak | None = None


class Gate:
    """Admits the commands of one tick, and writes them.

    Attributes:
        admitted: what was written, (n,).
        enable: whether the drives may be enabled.
        clamps: how many ticks had commands that were replaced.
    """

    def __init__(self, axes: Sequence[AxisLimits], rate: float, outputs: Sequence[Array]) -> None:
        """Take over the outputs.

        Args:
            axes: what each may be commanded.
            rate: ticks a second.
            outputs: where the commands are encoded from, contiguous; together one entry an axis, in their
                order.

        Raises:
            ValueError: the outputs are not as many as the axes, or of another kind.
        """
        self._axes, self._n = tuple(axes), len(axes)
        hold = max(CLAMPS_BEFORE_HOLD, ceil(CLAMPED_HOLD_S * rate))
        ramp, off = round(CLAMPED_RAMP_S * rate), round(CLAMPED_OFF_S * rate)
        self._clamped = Tally(
            Rule(Reaction.SANITISE, 1, 1),
            Rule(Reaction.HOLD, hold, hold),
            Rule(Reaction.HOLD, OFTEN * hold, OFTEN_WINDOW * hold),
            Rule(Reaction.RAMP, ramp, OFTEN * ramp),
            Rule(Reaction.OFF, off, OFTEN * off),
        )
        self._lost = Tally(
            Rule(Reaction.OFF, LOST_BEFORE_OFF, LOST_BEFORE_OFF),
            Rule(Reaction.RAMP, LOST_BEFORE_OFF, WINDOW),
        )
        self.admitted = np.zeros(self._n)
        if (count := sum(map(len, outputs))) != self._n:
            raise ValueError(f"{count} outputs for {self._n} axes")
        self._outputs = ffi.new("gate_output[]", [{"n": len(output)} for output in outputs])
        for k, output in enumerate(outputs):
            bind(lib, self._outputs, {}, k, commands=output)
        self.enable = False
        self.clamps = 0
        self._heat, self._tick = self._warming(rate), -1
        self._most = self._heat.able if self._heat else np.array([axis.command for axis in axes], float)
        self._bind()

    def _warming(self, rate: float) -> Heat | None:
        most, peaks = [axis.command for axis in self._axes], [axis.peak for axis in self._axes]
        # the last admitted commands stood since they were written
        return Heat(self.admitted, most, peaks, ADMITTED, 1.0 / rate) if any(peaks) else None

    def _bind(self) -> None:
        n = self._n
        self._command, self._position, self._velocity = (ffi.new("double[]", n) for _ in range(3))
        self._dropped, self._wrong = ffi.new("uint8_t[]", n), ffi.new("uint8_t[]", n)
        self._core = ffi.new("gate_axes *", {"n": n})
        keys = ("step", "power", "lower", "upper")
        bind(
            lib,
            self._core,
            most=self._most,
            **{key: np.array([getattr(axis, key) for axis in self._axes], float) for key in keys},
            command=self._command,
            position=self._position,
            velocity=self._velocity,
            dropped=self._dropped,
            admitted=self.admitted,
            wrong=self._wrong,
        )

    def deny(self) -> None:
        """Admit nothing: zero commands, drives not enabled."""
        self.admitted[:] = 0.0
        self.enable = False
        self._write()

    def admit(
        self,
        commands: Sequence[float],
        position: Sequence[float],
        velocity: Sequence[float],
        armed: bool,
        command_tick: int,
        tick: int,
        dropped: Sequence[bool],
    ) -> Verdict:
        """Check one command an axis against the measured state and write it; never raises for any numbers.

        Args:
            commands: one an axis.
            position: measured, one an axis.
            velocity: measured, one an axis.
            armed: without it nothing is admitted.
            command_tick: the tick the commands were computed for.
            tick: the present tick.
            dropped: one an axis, whether it gets no command any more: nobody knows what it does.
        """
        if self._heat:
            self._heat.take(max(0, tick - self._tick))
            self._tick = tick
        if not armed:
            self.deny()
            self._clamped.clear()
            self._lost.clear()
            return PASS
        if command_tick != tick:
            self.deny()
            return Verdict(
                Reaction.RAMP, "stale_output", f"the output was computed for tick {command_tick}, not {tick}"
            )
        self.enable = True
        n = self._n
        # each of these assignments raises where it is not given one number an axis
        self._command[0:n], self._position[0:n], self._velocity[0:n] = commands, position, velocity
        self._dropped[0:n] = dropped
        wrong: Sequence[int] = list(self._wrong) if lib.gate_admit(self._core) else ()
        if not wrong and self._lost.idle and self._clamped.idle:  # nearly every tick
            self._write()
            return PASS
        lost = self._lost.push(NO_NUMBER in wrong)
        if lost is Reaction.OFF:
            # the last admitted command stands in for what is no number, but not for long
            for i, what in enumerate(wrong):
                if what == NO_NUMBER:
                    self.admitted[i] = 0.0
        self._write()
        return self._judge(wrong, lost)

    def _write(self) -> None:
        lib.gate_write(self._core, self._outputs, len(self._outputs))

    def _judge(self, wrong: Sequence[int], lost: Reaction) -> Verdict:
        """What to say, given what is wrong with each command, nothing where all are fine."""
        clamped = self._clamped.push(bool(wrong))
        self.clamps += bool(wrong)
        if not (clamped or lost):
            return PASS
        if lost >= clamped and lost.stops:
            detail = f"{self._lost.count} of {WINDOW} ticks with commands that are no numbers"
            return Verdict(lost, "output_not_finite", detail)
        first = next((i for i, what in enumerate(wrong) if what), None)
        said = (
            "" if first is None else f"command of {self._axes[first].name} {self._why(first, wrong[first])}"
        )
        if clamped.stops:
            detail = f"{said or 'commands exceed limits'}, {self._clamped.count} ticks"
            return Verdict(clamped, OUTPUT_BEYOND_LIMIT, detail)
        return Verdict(Reaction.SANITISE, "output_clamped", said)

    def _why(self, i: int, what: int) -> str:
        """What is wrong with the command of an axis, for people."""
        axis, position = self._axes[i], self._position[i]
        return {
            lib.GATE_NO_NUMBER: "is not a number",
            lib.GATE_EXCEEDS: f"exceeds {self._most[i]:g}",
            lib.GATE_JUMPS: f"jumps by more than {axis.step:g}",
            lib.GATE_BEYOND_UPPER: f"pushes further at {position:g}, beyond {axis.upper:g}",
            lib.GATE_BEYOND_LOWER: f"pushes further at {position:g}, beyond {axis.lower:g}",
            lib.GATE_POWER: f"exceeds {axis.power:g} W",
        }[what]
