"""What devices measure of the mechanics: the truth, and to some of it white noise is added."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..binding import bind
from ..models import Array
from ._plant import ffi, lib

AHEAD = 32
"""Readings for which noise is drawn at once: one by one, drawing costs more than the numbers."""


class Probe(NamedTuple):
    """A field of devices.

    Attributes:
        said: what it says, (k,).
        truth: what it measures, (k,).
        noise: its standard deviation, (k,); None where it has none.
    """

    said: Array
    truth: Array
    noise: Array | None = None


class Probes:
    """All that a plant's devices measure; arrays are read and written where they are."""

    def __init__(self, probes: Sequence[Probe], random: np.random.Generator) -> None:
        """Noise is drawn in the order of the probes; nobody else may draw from ``random``."""
        self._random = random
        width = sum(len(probe.noise) for probe in probes if probe.noise is not None)
        self._white = np.zeros((AHEAD, width))
        table = ffi.new("probe[]", [{"n": len(probe.truth)} for probe in probes])
        for i, probe in enumerate(probes):
            bind(lib, table, {}, i, **probe._asdict())
        self._core = ffi.new("probes *", {"count": len(table), "rows": AHEAD, "width": width})
        bind(lib, self._core, probe=table, white=self._white)
        self._left = 0

    def read(self) -> None:
        """Let all of them say what they measure now."""
        if not self._left:
            self._random.standard_normal(out=self._white)
            self._core.next = 0
        self._left = lib.probes_read(self._core)
