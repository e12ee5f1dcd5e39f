"""Numbers of many ticks in few columns: lowest, highest and mean of each, so that no peak is lost."""

from __future__ import annotations

import numpy as np

from ..models import Array


class Decimator:
    """Takes any number of rows and keeps at most ``columns`` of them, in one pass and bounded memory.

    A column stands for a power of two of ticks; once there are too many columns, neighbours become one.

    Attributes:
        count: of columns in use.
    """

    def __init__(self, channels: int, columns: int) -> None:
        """Columns: an even number."""
        if columns < 2 or columns % 2:
            raise ValueError(f"{columns} columns: an even number of two or more is needed")
        self._low = np.full((columns, channels), np.inf)
        self._high = np.full((columns, channels), -np.inf)
        self._sum = np.zeros((columns, channels))
        self._rows, self._first = np.zeros(columns, np.int64), np.zeros(columns, np.int64)
        self._each = 1
        self.count = 0

    def add(self, tick: int, row: Array) -> None:
        """Take the numbers (channels,) of a tick; ticks ascend."""
        at = self.count - 1
        if at < 0 or self._rows[at] == self._each:
            if self.count == len(self._rows):
                self._halve()
            at = self.count
            self.count += 1
            self._first[at] = tick
        np.fmin(self._low[at], row, out=self._low[at])  # no number is no value
        np.fmax(self._high[at], row, out=self._high[at])
        self._sum[at] += row
        self._rows[at] += 1

    @property
    def ticks(self) -> Array:
        """First tick of each column, (count,)."""
        return self._first[: self.count].astype(float)

    @property
    def low(self) -> Array:
        """Lowest values, (count, channels)."""
        return self._low[: self.count]

    @property
    def high(self) -> Array:
        """Highest values, (count, channels)."""
        return self._high[: self.count]

    @property
    def mean(self) -> Array:
        """Means, (count, channels)."""
        return self._sum[: self.count] / self._rows[: self.count, None]

    def _halve(self) -> None:
        """Two neighbours become one; all columns are full."""
        half = self.count // 2
        self._low[:half] = np.minimum(self._low[0::2], self._low[1::2])
        self._high[:half] = np.maximum(self._high[0::2], self._high[1::2])
        self._sum[:half] = self._sum[0::2] + self._sum[1::2]
        self._rows[:half] = self._rows[0::2] + self._rows[1::2]
        self._first[:half] = self._first[0::2]
        self._low[half:], self._high[half:] = np.inf, -np.inf
        self._sum[half:], self._rows[half:] = 0.0, 0
        self._each *= 2
        self.count = half
