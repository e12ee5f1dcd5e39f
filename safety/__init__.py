"""The layers that may only reduce energy: gate, monitor, standstill, stop latch, arming."""

from .arming import DeadMan, Permission, refusals
from .check import Trust
from .gate import AxisLimits, Gate
from .heat import Heat, Peak
from .latch import TRIP_WORDS, StopLatch, Trip, describe, refusal
from .monitor import Monitor, overloaded
from .observation import Observation, Thresholds
from .plausibility import Axes, Course, Findings, Motion, Pairs, Plausibility, Values
from .set_points import SetPoint, SetPointGate
from .springs import Balance, Springs
from .standstill import Standstill, strayed
from .verdict import OUTPUT_BEYOND_LIMIT, PASS, Reaction, Verdict, strongest

__all__ = [
    "OUTPUT_BEYOND_LIMIT",
    "PASS",
    "TRIP_WORDS",
    "Axes",
    "AxisLimits",
    "Balance",
    "Course",
    "DeadMan",
    "Findings",
    "Gate",
    "Heat",
    "Monitor",
    "Motion",
    "Observation",
    "Pairs",
    "Peak",
    "Permission",
    "Plausibility",
    "Reaction",
    "SetPoint",
    "SetPointGate",
    "Springs",
    "Standstill",
    "StopLatch",
    "Thresholds",
    "Trip",
    "Trust",
    "Values",
    "Verdict",
    "describe",
    "overloaded",
    "refusal",
    "refusals",
    "strayed",
    "strongest",
]
