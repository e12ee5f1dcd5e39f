"""Halts before a collision, on a whole machine (docs/fault-matrix.md, row 26)."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from hapticd.control.look_ahead import standing
from hapticd.machines.giant.machine import foreseen_limits
from hapticd.machines.rendering.surroundings import watched
from hapticd.runtime.core.modes import Command, Mode

from .conftest import Bench

FLOOR = 'floor = "-2.05 m"       # the posts stand on it\n'
TABLE = """
[[look_ahead.obstacles]]
name = "the table"
centre = "1.15 -0.6 -1.15 m"
size = "0.3 0.4 0.4 m"
angles = "0 0 20 deg"
"""


class Room:
    """A giant with a table on the way of its hand."""

    def __init__(self) -> None:
        self.bench = Bench((FLOOR, FLOOR + TABLE))
        session = self.bench.lockstep.session
        robot, config = session.robot, session.config
        pairs, _ = watched(robot, config.look_ahead, foreseen_limits(config))
        self._look = standing(robot, pairs, config.look_ahead.margin)
        self.least = inf

    @property
    def near(self) -> float:
        """How near anything truly is [m]."""
        plant = self.bench.plant
        return float(self._look.distances(np.array([*plant.ppu.position, *plant.arm.q])).min())

    def until(self, *modes: Mode, limit: int) -> None:
        for _ in range(limit):
            if self.bench.mode in modes:
                return
            self.run(1)
        raise AssertionError(f"still {self.bench.mode.name}: {self.bench.said[-3:]}")

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.bench.run(1)
            self.least = min(self.least, self.near)

    def restart(self) -> None:
        """Let go, reset, press anew, until the machine renders again."""
        self.bench.press(False)
        self.until(Mode.STOPPED, limit=500)
        self.run(300)
        self.bench.run(1, Command.RESET)
        self.until(Mode.READY, limit=600)
        self.bench.press(True)
        self.until(Mode.ENGAGING, limit=500)


@pytest.fixture(scope="module")
def halted() -> Room:
    room = Room()
    room.until(Mode.ACTIVE, limit=4000)
    room.until(Mode.HOLDING, limit=2500)
    return room


def test_a_machine_halts_before_it_meets_anything_and_leaves_again(halted: Room) -> None:
    room, bench = halted, halted.bench
    assert bench.reason == "collision_ahead"
    assert any("would have met the table in " in said and "R2" in said for said in bench.said)
    room.run(300)  # the hand goes on pulling
    assert bench.mode is Mode.HOLDING
    assert room.least > 0.005
    near = room.near

    # led on towards the table, it halts again
    bench.plant.hand.take()
    room.restart()
    bench.plant.hand.lead((1.15, -0.6, -1.05))
    room.until(Mode.HOLDING, limit=4000)
    assert bench.reason == "collision_ahead"
    room.run(100)
    assert room.least > 0.003

    # led away, it goes
    room.restart()
    bench.plant.hand.lead((0.4, -0.8, -1.05))
    room.run(3500)
    assert bench.mode is Mode.ACTIVE
    assert room.near > near + 0.1


def test_without_the_look_ahead_the_same_hand_hits_the_table() -> None:
    room = Room()
    room.bench.cycle.machine._foresight._look = None
    room.until(Mode.ACTIVE, limit=4000)
    room.run(1500)
    assert room.least < -0.01
