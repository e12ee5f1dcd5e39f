"""The layers that may only reduce energy: gate, monitor, standstill, stop latch, arming."""

from .arming import DeadMan, Permission, refusals
from .gate import AxisLimits, Gate
from .latch import StopLatch, Trip, describe, refusal
from .monitor import Monitor, Trust
from .observation import Observation, Thresholds
from .plausibility import Axes, Findings, Motion, Pairs, Plausibility, Values
from .standstill import Standstill, strayed
from .verdict import PASS, Reaction, Verdict, strongest

__all__ = [
    "PASS",
    "Axes",
    "AxisLimits",
    "DeadMan",
    "Findings",
    "Gate",
    "Monitor",
    "Motion",
    "Observation",
    "Pairs",
    "Permission",
    "Plausibility",
    "Reaction",
    "Standstill",
    "StopLatch",
    "Thresholds",
    "Trip",
    "Trust",
    "Values",
    "Verdict",
    "describe",
    "refusal",
    "refusals",
    "strayed",
    "strongest",
]
