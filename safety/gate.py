"""The last code before bytes leave: an output goes out only if the gate admitted it.

Deny by default. The gate holds the outputs of the drives and nobody else writes them; a command that is not
admitted is replaced by a weaker one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from math import ceil, isfinite
from typing import Protocol

import numpy as np

from .heat import ADMITTED, Heat, Peak
from .tally import WINDOW, Rule, Tally
from .verdict import PASS, Reaction, Verdict, strongest

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


class Output(Protocol):
    """Commands of the drives of a group as they are encoded, one an axis."""

    def __len__(self) -> int:
        """Axes of the group."""

    def __setitem__(self, axes: slice, commands: Sequence[float], /) -> None:
        """Write commands."""


class Gate:
    """Admits the commands of one tick, and writes them.

    Attributes:
        admitted: what was written, one command an axis.
        enable: whether the drives may be enabled.
        clamps: how many commands were ever replaced.
    """

    def __init__(self, axes: Sequence[AxisLimits], rate: float, outputs: Sequence[Output]) -> None:
        """Take over the outputs.

        Args:
            axes: what each may be commanded.
            rate: ticks a second.
            outputs: where the commands are encoded from; together one entry an axis, in their order.

        Raises:
            ValueError: the outputs are not as many as the axes.
        """
        self._axes = tuple(axes)
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
        self.admitted = [0.0] * len(self._axes)
        ends = list(accumulate(map(len, outputs), initial=0))
        if ends[-1] != len(self._axes):
            raise ValueError(f"{ends[-1]} outputs for {len(self._axes)} axes")
        self._outputs = [(output, slice(*part)) for output, part in zip(outputs, pairwise(ends), strict=True)]
        self.enable = False
        self.clamps = 0
        self._most = [axis.command for axis in self._axes]
        self._told, self._tick = np.zeros(len(self._axes)), -1
        self._heat = self._warming(rate)

    def _warming(self, rate: float) -> Heat | None:
        peaks = [axis.peak for axis in self._axes]
        return Heat(self._told, self._most, peaks, ADMITTED, 1.0 / rate) if any(peaks) else None

    def deny(self) -> None:
        """Admit nothing: zero commands, drives not enabled."""
        for i in range(len(self.admitted)):
            self.admitted[i] = 0.0
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
            self._warm(self._heat, tick)
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
        verdict = PASS
        bad = [not (isfinite(command) or gone) for command, gone in zip(commands, dropped, strict=True)]
        lost = self._lost.push(any(bad))
        for i, axis in enumerate(self._axes):
            if dropped[i]:
                self.admitted[i] = 0.0
            elif bad[i]:  # the last admitted command stands, but not for long
                if lost is Reaction.OFF:
                    self.admitted[i] = 0.0
                verdict = strongest(verdict, _sanitised(axis, "is not a number"))
            else:
                safe, why = _clamp(
                    *(axis, self._most[i], commands[i], self.admitted[i], position[i], velocity[i])
                )
                self.admitted[i] = safe
                if why:
                    verdict = strongest(verdict, _sanitised(axis, why))
        self._write()
        return self._judge(verdict, lost)

    def _warm(self, heat: Heat, tick: int) -> None:
        """The last admitted commands stood since then; what they leave of the motors' budgets."""
        self._told[:] = self.admitted
        heat.take(max(0, tick - self._tick))
        self._tick, self._most = tick, heat.able.tolist()

    def _write(self) -> None:
        for output, part in self._outputs:
            output[:] = self.admitted[part]

    def _judge(self, verdict: Verdict, lost: Reaction) -> Verdict:
        clamped = self._clamped.push(verdict is not PASS)
        self.clamps += verdict is not PASS
        if lost >= clamped and lost.stops:
            detail = f"{self._lost.count} of {WINDOW} ticks with commands that are no numbers"
            return Verdict(lost, "output_not_finite", detail)
        if not clamped.stops:
            return verdict
        detail = f"{verdict.detail or 'commands exceed limits'}, {self._clamped.count} ticks"
        return Verdict(clamped, "output_beyond_limit", detail)


def _sanitised(axis: AxisLimits, why: str) -> Verdict:
    return Verdict(Reaction.SANITISE, "output_clamped", f"command of {axis.name} {why}")


def _clamp(
    axis: AxisLimits, most: float, command: float, last: float, position: float, velocity: float
) -> tuple[float, str]:
    """A command that respects the axis and what it may be told now, and what was wrong with the given one.

    Nothing, '', where it is the given one.
    """
    safe, why = command, ""
    if abs(safe) > most:
        safe, why = _limited(safe, most), f"exceeds {most:g}"
    if abs(safe - last) > axis.step:
        safe, why = last + _limited(safe - last, axis.step), f"jumps by more than {axis.step:g}"
    # comparisons that a NaN fails: an axis without a valid position gets no command in either direction
    if safe > 0.0 and not position <= axis.upper:
        safe, why = 0.0, f"pushes further at {position:g}, beyond {axis.upper:g}"
    if safe < 0.0 and not position >= axis.lower:
        safe, why = 0.0, f"pushes further at {position:g}, beyond {axis.lower:g}"
    if not safe * velocity <= axis.power:  # what brakes takes power out, and may take all it can
        most = axis.power / abs(velocity) if isfinite(velocity) else 0.0
        safe, why = _limited(safe, most), f"exceeds {axis.power:g} W"
    return safe, why


def _limited(value: float, most: float) -> float:
    return most if value > most else -most if value < -most else value
