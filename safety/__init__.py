"""The layers that may only reduce energy: gate, monitor, stop latch, arming."""

from .arming import DeadMan, refusals
from .gate import AxisLimits, Gate
from .latch import StopLatch, Trip, describe
from .monitor import Monitor, Observation, Thresholds
from .verdict import PASS, Reaction, Verdict, strongest

__all__ = [
    "PASS",
    "AxisLimits",
    "DeadMan",
    "Gate",
    "Monitor",
    "Observation",
    "Reaction",
    "StopLatch",
    "Thresholds",
    "Trip",
    "Verdict",
    "describe",
    "refusals",
    "strongest",
]
