"""Recorded problems of the giant: closed-loop ticks with their unique optimum (bench/data/*.npz)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hapticd.hqp import Level
from numpy.typing import NDArray

DATA = Path(__file__).with_name("data")
PARTS = ("A", "b", "C", "lb", "ub")


@dataclass(frozen=True, slots=True)
class Recording:
    """Consecutive 1 kHz ticks.

    Attributes:
        name: file name without hqp_ and .npz.
        group: (ticks,), the window each tick belongs to; ticks are consecutive only inside one.
        x: (ticks, n), the optimum.
        norms: (ticks, levels), its slack norms.
        parts: per level A, b, C, lb and ub, ticks along their first axis.
    """

    name: str
    group: NDArray[np.int32]
    x: NDArray[np.float64]
    norms: NDArray[np.float64]
    parts: Sequence[tuple[NDArray[np.float64], ...]]

    def __len__(self) -> int:
        """Number of ticks."""
        return len(self.group)

    def levels(self, tick: int) -> list[Level]:
        """The problem of one tick, in arrays of its own."""
        return [Level(**{k: a[tick].copy() for k, a in zip(PARTS, part, strict=True)}) for part in self.parts]

    def replay(self, ticks: Sequence[int] | None = None) -> Iterator[tuple[int, list[Level]]]:
        """Each tick and its problem, all in the same arrays: as a control loop would hand them over."""
        shared = self.levels(0)
        for tick in range(len(self)) if ticks is None else ticks:
            for level, part in zip(shared, self.parts, strict=True):
                for name, array in zip(PARTS, part, strict=True):
                    getattr(level, name)[...] = array[tick]
            yield tick, shared

    def follows(self, tick: int) -> bool:
        """Whether the tick comes 1 ms after the one before it."""
        return tick > 0 and bool(self.group[tick] == self.group[tick - 1])


def load(path: Path) -> Recording:
    """Read one file."""
    with np.load(path) as data:
        count = data["norms"].shape[1]
        parts = [tuple(np.array(data[f"p{p}_{k}"], dtype=float) for k in PARTS) for p in range(1, count + 1)]
        name = path.stem.removeprefix("hqp_")
        return Recording(name, data["group"], data["x"], data["norms"], parts)
