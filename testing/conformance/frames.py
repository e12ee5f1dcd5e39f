"""Whatever arrives on the bus: no exception, no command beyond a limit, nothing that goes on by itself."""

from __future__ import annotations

import random

import numpy as np
import pytest

from ...devices.frames import MAX_DATA, Frames
from ...runtime.core.modes import Command, Mode
from ...sim.node import Tamper
from ..bench import Bench

SEEDS = range(12)
FUZZED_S = 0.2


def damage(rng: random.Random, share: float) -> Tamper:
    """A share of the frames of a device is lost, cut, stretched, repeated, or has bits flipped."""

    def tamper(can_id: int, data: bytes) -> list[tuple[int, bytes]]:
        if rng.random() > share:
            return [(can_id, data)]
        match rng.randrange(5):
            case 0:
                return []
            case 1:
                return [(can_id, data[: rng.randrange(len(data) + 1)])]
            case 2:
                return [(can_id, data + bytes(rng.randrange(MAX_DATA - len(data) + 1)))]
            case 3:
                return [(can_id, data)] * 2
            case _:
                flipped = bytearray(data)
                for _ in range(rng.randrange(1, 4)):
                    flipped[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
                return [(can_id, bytes(flipped))]

    return tamper


def strange(rng: random.Random) -> Frames:
    """A few frames of anybody."""
    frames = Frames()
    for _ in range(rng.randrange(3)):
        frames.append(rng.randrange(0x800), rng.randbytes(rng.randrange(MAX_DATA + 1)))
    return frames


@pytest.mark.parametrize("seed", SEEDS)
def test_frames_that_are_damaged_or_strange_move_nothing_beyond_its_limits(moving: Bench, seed: int) -> None:
    rng, machine = random.Random(seed), moving.cycle.machine
    share, strangers = rng.choice((0.01, 0.1, 0.5)), seed % 3 == 0
    nodes = moving.nodes.nodes if seed % 2 else [rng.choice(moving.nodes.nodes)]
    for node in nodes:
        node.tamper = damage(rng, share)
    for _ in range(moving.ticks(FUZZED_S)):
        if strangers and rng.random() < 0.1:
            moving.lockstep._bus.send(strange(rng))
        moving.run(1, rng.choice((Command.NONE,) * 20 + (Command.RESET, Command.ARM)))
        admitted = moving.cycle.gate.admitted
        assert np.isfinite(admitted).all()
        assert all(abs(c) <= axis.command for c, axis in zip(admitted, machine.axes, strict=True))
    for node in nodes:
        node.tamper = None
    if moving.mode is Mode.ACTIVE:
        return
    stops = moving.cycle.stops
    moving.until(Mode.STOPPED, Mode.HOLDING, limit=stops.hold_limit + stops.ramp_limit)
    moving.run(moving.ticks(0.3))
    assert moving.mode in (Mode.STOPPED, Mode.HOLDING)
    assert moving.safe == (moving.mode is Mode.STOPPED)


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_that_arrives_while_the_machine_waits_starts_it(waiting: Bench, seed: int) -> None:
    rng = random.Random(seed)
    for node in waiting.nodes.nodes:
        if node is not waiting.plc:  # whose word is that the switch is pressed
            node.tamper = damage(rng, 0.2)
    for _ in range(waiting.ticks(FUZZED_S)):
        waiting.lockstep._bus.send(strange(rng))
        waiting.run(1)
        assert waiting.safe
        assert waiting.mode in (Mode.READY, Mode.STOPPED)
