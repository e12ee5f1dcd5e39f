"""Machines that render a twin, watch the passivity of the handle, and foretell the hand's wrench."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.config import parse
from hapticd.runtime.configuration.session import build
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.recording import replay as replaying
from hapticd.runtime.recording.log import open_log


def watching(name: str, key: str = "passivity = true") -> config.Loaded:
    """A built-in machine with one key of its force control, and without `lead` unless that is it."""
    loaded = config.load(name)
    table, found, rest = loaded.text.partition(".force_control]\n")
    assert found
    rest = re.sub(r"(?m)^lead = .*\n", "", rest, count=1)
    text = f"{table}{found}{key}\n{rest}"
    return replace(loaded, text=text, config=parse(text, loaded.source))


@pytest.mark.parametrize("name", ["giant", "panda"])
def test_a_session_that_is_watched_can_be_replayed(name: str, tmp_path: Path) -> None:
    outcome = lockstep_run.run(watching(name), tmp_path / "log.mcap", 3.0, live=False)
    assert outcome.status == 0, outcome.message
    found = replaying.replay(open_log(str(tmp_path / "log.mcap")))
    assert found.differing_ticks == 0 and found.ticks >= 2000


@pytest.mark.parametrize("name", ["giant", "panda"])
def test_only_what_is_watched_is_damped_and_logged(name: str) -> None:
    assert "damping" not in (build(config.load(name)).cycle.machine.state.names or ())
    machine = build(watching(name)).cycle.machine
    state = np.zeros(1, machine.state)
    machine.bind_state(state)
    rendering = machine._rendering  # type: ignore[attr-defined]
    rendering.passivity.damping[:] = 12.0, 0.5
    machine.fill()
    assert state["damping"][0].tolist() == [12.0, 0.5]


def test_the_twin_feels_the_damping() -> None:
    machine = build(watching("giant")).cycle.machine
    rendering = machine._rendering  # type: ignore[attr-defined]
    control = rendering.control
    control.reset(np.array([-0.9, 1.57, -0.67, 0.96, 0.08, 0.0]))
    rendering._link[:] = control.q
    seen: list[list[float]] = []
    for watch in (None, rendering.passivity):
        rendering.passivity = watch
        control.twin.twist[2] = 0.0
        rendering.render(np.zeros(6), 1.0, 1.0, np.zeros(2))
        control.twin.twist[2] = 0.1
        if watch:
            watch.damping[0] = 50.0
        rendering.render(np.zeros(6), 1.0, 1.0, np.zeros(2))
        seen.append(control.twin.force.tolist())
    without, damped = seen
    assert without[2] == pytest.approx(-8.0 * 0.1)
    assert damped[2] == pytest.approx(-(8.0 + 50.0) * 0.1, rel=0.05)


@pytest.mark.parametrize("name", ["giant", "panda"])
def test_the_twin_is_moved_ahead_of_the_wrench_that_is_measured(name: str) -> None:
    moved = []
    for key in ("passivity = false", 'lead = "2.5 ms"'):
        machine = build(watching(name, key)).cycle.machine
        rendering = machine._rendering  # type: ignore[attr-defined]
        rendering.control.reset(np.full(rendering.control.arm.n, 0.9))
        rendering.render(np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0]), 1.0, 1.0, np.zeros(2))
        assert rendering.felt[2] == 5.0  # the log, and what the joints hold against, are as measured
        moved.append(float(rendering.control.twin.force[2]))
    assert moved[0] == 5.0
    assert moved[1] == pytest.approx(5.0 * (1.0 + 0.157 * 0.939), rel=1e-3)
