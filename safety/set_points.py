"""The gate of what has a controller of its own: fingers, a neck, a base are told where to be, or how fast.

As for the drives, deny by default: without leave such a device gets no power, and nobody else writes what it
is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from .gate import CLAMPED_HOLD_S, CLAMPS_BEFORE_HOLD, OFTEN, OFTEN_WINDOW
from .tally import Rule, Tally
from .verdict import OUTPUT_BEYOND_LIMIT, PASS, Reaction, Verdict

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SetPoint:
    """What one coordinate of a device may be told, in its own unit.

    Attributes:
        name: for people.
        lower, upper: range.
        step: largest change from one tick to the next.
        rest: what it is told before it has power; None: where it is measured.
    """

    name: str
    lower: float
    upper: float
    step: float
    rest: float | None = None


class SetPointGate:
    """Admits what such devices are told at a tick, and writes it.

    Attributes:
        admitted: what was written, (n,).
        enable: whether they may have power.
        clamps: how many ticks had something that was replaced.
    """

    def __init__(
        self,
        points: Sequence[SetPoint],
        rate: float,
        measured: Sequence[Values],
        outputs: Sequence[Values],
        enables: Sequence[NDArray[np.uint32]],
    ) -> None:
        """Take over the outputs.

        Args:
            points: what each may be told.
            rate: ticks a second.
            measured: where each is; together one number a point, in their order.
            outputs: what is encoded, likewise.
            enables: words of the devices, (1,) each: 1 gives them power.

        Raises:
            ValueError: the outputs, or what is measured, are not as many as the points.
        """
        for name, views in (("outputs", outputs), ("measurements", measured)):
            if (count := sum(map(len, views))) != len(points):
                raise ValueError(f"{count} {name} for {len(points)} set points")
        self._points, self._measured, self._outputs = tuple(points), list(measured), list(outputs)
        self._enables = list(enables)
        self._lower, self._upper, self._step = (
            np.array([getattr(point, key) for point in points], float) for key in ("lower", "upper", "step")
        )
        self._resting = np.array([point.rest is not None for point in points], np.bool_)
        self._rest = np.array([point.rest or 0.0 for point in points], float)
        hold = max(CLAMPS_BEFORE_HOLD, ceil(CLAMPED_HOLD_S * rate))
        self._clamped = Tally(
            Rule(Reaction.SANITISE, 1, 1),
            Rule(Reaction.HOLD, hold, hold),
            Rule(Reaction.HOLD, OFTEN * hold, OFTEN_WINDOW * hold),
        )
        self.admitted: Values = np.where(self._resting, self._rest, 0.0)
        self.enable, self.clamps = False, 0

    def deny(self) -> None:
        """No power; what they would be told is where they are."""
        there = np.concatenate(self._measured) if self._measured else self._rest
        there = np.where(np.isfinite(there), there, self.admitted)
        self.admitted[:] = np.where(self._resting, self._rest, np.clip(there, self._lower, self._upper))
        self.enable = False
        self._clamped.clear()
        self._write()

    def admit(self, wanted: Values, armed: bool) -> Verdict:
        """Check one number a point and write it; never raises for any numbers.

        Args:
            wanted: (n,).
            armed: without it nothing is admitted.
        """
        if not armed:
            self.deny()
            return PASS
        self.enable = True
        last = self.admitted
        low, high = np.maximum(last - self._step, self._lower), np.minimum(last + self._step, self._upper)
        safe = np.minimum(np.maximum(wanted, low), high)
        bad = safe != wanted  # as is what is not a number
        clamped = bool(np.count_nonzero(bad))
        np.copyto(last, safe, where=safe == safe)
        self._write()
        self.clamps += clamped
        reaction = self._clamped.push(clamped)
        if reaction is Reaction.PASS:
            return PASS
        where = self._points[int(bad.argmax())].name if clamped else "set points"
        if reaction.stops:
            detail = f"{where} is told what it may not, {self._clamped.count} ticks"
            return Verdict(reaction, OUTPUT_BEYOND_LIMIT, detail)
        return Verdict(reaction, "output_clamped", f"{where} is told what it may not")

    def _write(self) -> None:
        at = 0
        for output in self._outputs:
            output[:] = self.admitted[at : at + len(output)]
            at += len(output)
        for word in self._enables:
            word[0] = self.enable
