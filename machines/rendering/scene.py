"""What a machine that renders a twin tells those who draw it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def felt_wrench(state: np.void) -> Sequence[float]:
    """Of the hand on the machine at the handle, (6,) [N, N m]."""
    wrench: list[float] = state["wrench"].tolist()
    return wrench


def twin_position(state: np.void) -> Sequence[float]:
    """Where the twin has the handle, (3,) [m]."""
    place: list[float] = state["twin_position"].tolist()
    return place
