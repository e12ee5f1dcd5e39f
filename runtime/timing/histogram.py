"""A histogram of durations in C: 1.6 % wide buckets from nanoseconds to minutes."""

from __future__ import annotations

from typing import Any

from .._rt import ffi, lib

Quantiles = dict[str, float]


class Histogram:
    """Durations in nanoseconds."""

    def __init__(self, at: Any = None) -> None:
        """An empty one, or the one that is there."""
        self._h = ffi.new("rt_histogram *") if at is None else at

    def add(self, ns: int) -> None:
        """Count one duration; negative ones count as zero."""
        lib.rt_histogram_add(self._h, ns)

    @property
    def count(self) -> int:
        """How many were added."""
        return int(self._h.count)

    def quantile(self, q: float) -> float:
        """Duration [us] that the share q of all does not exceed."""
        return int(lib.rt_histogram_quantile(self._h, q)) / 1e3

    def cells(self) -> list[tuple[float, int]]:
        """Upper edge [us] and count of every bucket in use."""
        counts = enumerate(self._h.bucket)
        return [(int(lib.rt_histogram_edge(i)) / 1e3, count) for i, count in counts if count]

    def summary(self) -> Quantiles:
        """mean, p50, p99, p99.9 and max [us]."""
        mean = self._h.sum / self._h.count / 1e3 if self._h.count else 0.0
        return {
            "mean": round(mean, 1),
            "p50": self.quantile(0.5),
            "p99": self.quantile(0.99),
            "p999": self.quantile(0.999),
            "max": int(self._h.largest) / 1e3,
        }


class Histograms:
    """Of durations that come together, a histogram each.

    Attributes:
        each: they.
    """

    def __init__(self, n: int) -> None:
        self._rows, self._n = ffi.new("rt_histogram[]", n), n
        self.each = tuple(Histogram(self._rows + i) for i in range(n))

    def add(self, ns: bytes) -> None:
        """Count a duration in each: n uint32 in nanoseconds, little endian."""
        if len(ns) != 4 * self._n:
            raise ValueError(f"{len(ns)} bytes; {self._n} durations have {4 * self._n}")
        lib.rt_histogram_add_each(self._rows, self._n, ns)


def nanosleep_loop(period_ns: int, ticks: int) -> tuple[Histogram, int]:
    """Lateness of a bare C loop on the same kind of grid, and how many deadlines it missed."""
    histogram = Histogram()
    missed = int(lib.rt_nanosleep_loop(period_ns, ticks, histogram._h))
    return histogram, missed
