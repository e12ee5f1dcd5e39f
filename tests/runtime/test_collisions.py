"""Halts before a collision, on a whole machine (docs/fault-matrix.md, row 26)."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pytest
from hapticd.control.look_ahead import standing
from hapticd.machines.giant.parts import foreseen_limits
from hapticd.machines.rendering.surroundings import watched
from hapticd.runtime.configuration.config import load
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Command, Mode
from hapticd.runtime.live.lockstep import Lockstep
from msgspec.structs import replace as replaced

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


def test_a_hand_that_is_stronger_than_a_machine_that_holds_overloads_it_and_no_gate_is_blamed() -> None:
    loaded = load("giant")
    config: Any = loaded.config
    hand, look = config.simulation.hand, config.look_ahead
    first, down = hand.path[0], list(hand.path[0].position)
    down[2] -= 0.5
    still = [replaced(first, at=at) for at in (0.0, 0.1, 0.2, 3.8, 3.9, 4.0)]
    pulls = [replaced(first, at=at, position=tuple(down)) for at in (5.0, 5.1, 5.2, 9.0)]
    strong = replaced(hand, path=(*still, *pulls), force=250.0, stiffness=3000.0)
    over = replaced(
        config,
        look_ahead=replaced(look, floor=type(look.floor)(-1.0)),
        simulation=replaced(config.simulation, hand=strong, touches={}),
    )
    lockstep = Lockstep(build(replace(loaded, config=over)))
    modes = set()
    while lockstep.mode is not Mode.STOPPED and lockstep.inputs.tick < 9000:
        lockstep.tick()
        modes.add(lockstep.mode)
    last = lockstep.session.cycle.stops.last
    assert last is not None and Mode.HOLDING in modes
    assert last.verdict.reason == "overloaded" and "joint_4" in last.verdict.detail
