"""What people look at beside the machine's own numbers: switches, bus and solver, as a session has them."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.hqp import Status
from hapticd.hqp.certificate import slack_norms
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.recording.channels import Channels, Group
from hapticd.runtime.recording.frames import FrameMaker
from hapticd.runtime.recording.record import NO_TIMING, RecordWriter

from .conftest import Bench, parked


class Watched:
    """A bench, and what is recorded of its ticks."""

    def __init__(self, bench: Bench) -> None:
        session = bench.lockstep.session
        self.bench, self.writer = bench, RecordWriter(session.cycle)
        self.channels, self.frames = Channels(session), FrameMaker(session)

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.bench.run(1)
            self.writer.write(self.bench.lockstep.inputs, NO_TIMING)
            self.frames.tick(self.writer.fixed[0].copy())

    def value(self, name: str) -> float:
        names = [spec.name for spec in self.channels.specs]
        return self.channels.values(self.writer.fixed[0])[names.index(name)]


@pytest.fixture
def rendering() -> Bench:
    """A giant that has just engaged."""
    return parked(Mode.ACTIVE, 1)


def test_the_switch_is_as_old_as_its_last_word_and_its_last_change(rendering: Bench) -> None:
    bench, watched = rendering, Watched(rendering)
    watched.run(5)
    assert watched.value("dead-man last heard") == 0.0
    assert watched.value("frames received") == bench.cycle.image.expected
    pressed = watched.frames.take({}, None)
    assert pressed and pressed.pressed and pressed.received == 5 * bench.cycle.image.expected
    bench.plc.silent = True
    watched.run(4)  # its last word was under way
    assert watched.value("dead-man last heard") == pytest.approx(3e3 * bench.dt)
    assert watched.value("frames received") == bench.cycle.image.expected - 1
    bench.plc.silent = False
    bench.press(False)
    before = bench.tick_index
    watched.run(4)
    opened = watched.frames.take({}, None)
    assert opened and not opened.pressed and 0 < opened.since - before <= 2
    assert watched.value("dead-man last heard") == 0.0
    watched.run(100)
    later = watched.frames.take({}, None)
    assert later and later.since == opened.since


def test_every_level_of_a_rendered_twin_has_its_slack_by_its_name(rendering: Bench) -> None:
    bench, watched = rendering, Watched(rendering)
    control = bench.cycle.machine.force_control  # type: ignore[attr-defined]
    watched.run(1)
    first = watched.channels.groups[Group.SOLVER].start
    names = [spec.name for spec in watched.channels.specs[first:]]
    assert names[:2] == ["solver status", "levels proven"] and names[-1] == "slack of twin: dynamics"
    assert len(names) == 2 + len(control.levels)
    assert watched.value("solver status") == Status.SOLVED
    assert watched.value("levels proven") == len(control.levels)
    # a coupling that asks for more than joints may gets what they can
    control.levels[control._chain.coupling_level].b[:] += 1e4
    solution = control._solver.solve(control.levels)
    watched.writer.write(bench.lockstep.inputs, NO_TIMING)
    expected = slack_norms(control.levels, solution.x)
    assert expected[control._chain.coupling_level] > 1e3
    assert watched.writer.fixed["state"]["slack"][0] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert watched.value("slack of handle on twin") == pytest.approx(expected[control._chain.coupling_level])


def test_a_stop_leaves_the_coupling_out(rendering: Bench) -> None:
    bench, watched = rendering, Watched(rendering)
    control = bench.cycle.machine.force_control  # type: ignore[attr-defined]
    bench.press(False)
    bench.until(Mode.STOPPING)
    watched.run(1)
    assert control._asked is control._stop_solver
    kept = control._chain.stop_levels[:-1]
    expected = np.insert(slack_norms(kept, control.solution.x), control._chain.coupling_level, 0.0)
    found = watched.writer.fixed["state"]["slack"][0]
    assert found[: len(expected)] == pytest.approx(expected, abs=1e-9) and not found[len(expected) :].any()
    assert watched.value("levels proven") == 0.0  # nothing is rendered


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
def test_a_redundant_interface_solves_levels_or_none(resolution: str) -> None:
    bench = Bench(('resolution = "projection"', f'resolution = "{resolution}"'), machine="rhi")
    watched = Watched(bench)
    bench.until(Mode.ENGAGING)
    watched.run(20)
    place = watched.channels.groups[Group.SOLVER]
    solved = watched.channels.specs[place]
    assert len(solved) == (6 if resolution == "hqp" else 0)
    if solved:
        assert watched.value("levels proven") == 4.0  # the last is force and posture
        slack = watched.writer.fixed["state"]["slack"][0]
        law = bench.cycle.machine.controller.resolution  # type: ignore[attr-defined]
        assert slack == pytest.approx(slack_norms(law._levels, law._solver.solution.x), abs=1e-9)
        assert slack[-1] > 0.0  # the posture takes what is left
