"""The layers that may only reduce energy: gate, monitor, standstill, stop latch, arming."""

from .arming import DeadMan, Permission, refusals
from .gate import AxisLimits, Gate
from .latch import StopLatch, Trip, describe, refusal
from .monitor import Monitor, Observation, Thresholds
from .standstill import Standstill, strayed
from .verdict import PASS, Reaction, Verdict, strongest

__all__ = [
    "PASS",
    "AxisLimits",
    "DeadMan",
    "Gate",
    "Monitor",
    "Observation",
    "Permission",
    "Reaction",
    "Standstill",
    "StopLatch",
    "Thresholds",
    "Trip",
    "Verdict",
    "describe",
    "refusal",
    "refusals",
    "strayed",
    "strongest",
]
