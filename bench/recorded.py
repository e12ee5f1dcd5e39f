"""Recorded problems of the giant: closed-loop ticks with their unique optimum (bench/data/*.npz)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from zipfile import BadZipFile, is_zipfile

import numpy as np
from numpy.typing import NDArray

from ..hqp import Level, Solver
from ..hqp.certificate import slack_norms
from ..runtime.errors import HapticdError

DATA = Path(__file__).with_name("data")
NAMES = ("cartesian", "excavator", "door", "cycling")
PARTS = ("A", "b", "C", "lb", "ub")


class BenchError(HapticdError):
    """A benchmark that cannot run as asked; the message says how to mend it."""

    code = "bench"
    exit_status = 2


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

    def replay(self, ticks: Sequence[int] | None = None) -> Iterator[tuple[int, Sequence[Level]]]:
        """Each tick and its problem, all in the same arrays: as a control loop would hand them over."""
        shared = tuple(self.levels(0))
        for tick in range(len(self)) if ticks is None else ticks:
            for level, part in zip(shared, self.parts, strict=True):
                for name, array in zip(PARTS, part, strict=True):
                    getattr(level, name)[...] = array[tick]
            yield tick, shared

    def follows(self, tick: int) -> bool:
        """Whether the tick comes 1 ms after the one before it."""
        return tick > 0 and bool(self.group[tick] == self.group[tick - 1])


def normalised(recording: Recording) -> Recording:
    """The recording with every row scaled to length 1, which is another problem where rows are missed.

    Solvers that scale rows by themselves, as DAQP does, are compared on this one. The answers are those of
    our solver, cold; figures.count_wrong asks their certificate where another answer differs.
    """
    parts = [_unit(part) for part in recording.parts]
    same = Recording(
        f"{recording.name}, rows normalised", recording.group, recording.x, recording.norms, parts
    )
    solver = Solver(recording.x.shape[1], [level.rows for level in same.levels(0)])
    x, norms = np.empty_like(recording.x), np.empty_like(recording.norms)
    for tick, levels in same.replay():
        solver.reset()
        x[tick] = solver.solve(levels).x
        norms[tick] = slack_norms(levels, x[tick])
    return replace(same, x=x, norms=norms)


def _unit(part: tuple[NDArray[np.float64], ...]) -> tuple[NDArray[np.float64], ...]:
    """A, b, C, lb and ub of a level, ticks first, with rows of length 1; rows of zeros stay."""
    A, b, C, lb, ub = part
    of_a, of_c = np.linalg.norm(A, axis=2), np.linalg.norm(C, axis=2)
    of_a[of_a == 0.0], of_c[of_c == 0.0] = 1.0, 1.0
    return A / of_a[:, :, None], b / of_a, C / of_c[:, :, None], lb / of_c, ub / of_c


def shipped() -> list[Path]:
    """The recordings that come with the package."""
    return [DATA / f"hqp_{name}.npz" for name in NAMES]


def load(path: Path) -> Recording:
    """Read one file.

    Raises:
        BenchError: no file, or one of another layout.
    """
    try:
        if path.is_file() and not is_zipfile(path):  # numpy would offer to load what it takes for a pickle
            raise BadZipFile("it is no .npz file")
        with np.load(path) as data:
            count = data["norms"].shape[1]
            parts = [
                tuple(np.array(data[f"p{p}_{k}"], dtype=float) for k in PARTS) for p in range(1, count + 1)
            ]
            return Recording(path.stem.removeprefix("hqp_"), data["group"], data["x"], data["norms"], parts)
    except OSError as error:
        raise BenchError(f"cannot read {path}: {error.strerror or error}; name a file with --data") from error
    except (KeyError, ValueError, AttributeError, IndexError, EOFError, BadZipFile) as error:
        raise BenchError(
            f"{path} is no recording of problems: {error}; it must be an .npz file with group, x, norms and"
            " p1_A, p1_b, p1_C, p1_lb, p1_ub, p2_A, ... as in bench/data"
        ) from error
