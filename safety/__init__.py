"""The layers that may only reduce energy: gate, monitor, stop latch, arming."""

from .arming import DeadMan, refusals
from .gate import AxisLimits, Gate
from .latch import StopLatch, Trip, describe
from .monitor import Monitor, Trust
from .observation import Observation, Thresholds
from .plausibility import Axes, Findings, Motion, Pairs, Plausibility, Values
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
    "Plausibility",
    "Reaction",
    "StopLatch",
    "Thresholds",
    "Trip",
    "Trust",
    "Values",
    "Verdict",
    "describe",
    "refusals",
    "strongest",
]
