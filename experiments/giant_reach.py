"""What the giant's handle reaches, by random postures within every limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..machines.giant.config import GiantConfig
from ..machines.giant.kinematics import DROP, FOREARM, HANDLE, LOWER, UPPER
from ..models import Array

CELL, SLICE = 0.1, 0.01
"""Cells of the workspace, wide and high [m]."""


@dataclass(frozen=True, slots=True)
class Workspace:
    """What the handle reaches.

    Attributes:
        volume: [m^3]; extent: along x, y, z, (3,) [m]; filled: share of the box about it.
        slices: heights [m] and areas [m^2].
    """

    volume: float
    extent: Array
    filled: float
    slices: tuple[Array, Array]


def workspace(settings: GiantConfig, samples: int, seed: int = 0) -> Workspace:
    """Cells that the handle reaches in random postures within every limit of the machine."""
    m, box, axes = settings.giant.manipulator, settings.giant.box, settings.giant.ppu
    random = np.random.default_rng(seed)
    tilt, q4 = random.uniform(m.tilt[0], m.tilt[1], samples), random.uniform(m.lower[3], m.upper[3], samples)
    yaw = random.uniform(-np.pi, np.pi, samples)
    q2, q3 = (random.uniform(m.lower[i], m.upper[i], samples) for i in (1, 2))
    x, y = (random.uniform(axes.lower[i], axes.upper[i], samples) for i in range(2))
    q1 = yaw - q2 - q3
    elbow = np.stack(
        [x + UPPER * np.cos(q1) + LOWER * np.cos(q1 + q2), y + UPPER * np.sin(q1) + LOWER * np.sin(q1 + q2)]
    )
    reach = FOREARM * np.sin(q4) + HANDLE * np.sin(tilt)
    height = -DROP - FOREARM * np.cos(q4) - HANDLE * np.cos(tilt)
    place = np.stack([elbow[0] - reach * np.cos(yaw), elbow[1] - reach * np.sin(yaw), height])
    low, high = np.array(box.lower), np.array(box.upper)
    q5 = tilt - q4
    kept = (
        ((place >= low[:, None]) & (place <= high[:, None])).all(0) & (q5 >= m.lower[4]) & (q5 <= m.upper[4])
    )
    kept &= ((elbow >= low[:2, None]) & (elbow <= high[:2, None])).all(0)
    place = place[:, kept]
    cells = np.unique(((place - low[:, None]) / [[CELL], [CELL], [SLICE]]).astype(int), axis=1)
    heights, counts = np.unique(cells[2], return_counts=True)
    extent = np.ptp(place, axis=1)
    volume = cells.shape[1] * CELL * CELL * SLICE
    return Workspace(
        volume,
        extent,
        volume / float(extent.prod()),
        (np.asarray(low[2] + SLICE * heights), np.asarray(CELL * CELL * counts)),
    )
