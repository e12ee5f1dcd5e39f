"""How strong and how fast random hands are at most, and what else may be random."""

from __future__ import annotations

from dataclasses import dataclass

RANDOM = "random"
"""Asks for another digital twin in each session."""


@dataclass(frozen=True, slots=True)
class Temper:
    """The most that hands do: force [N], torque [N m], speed [m/s]."""

    force: float = 50.0
    torque: float = 10.0
    speed: float = 1.5
