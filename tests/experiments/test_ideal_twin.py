"""A free mass in a simulated hand without a machine, and how much of its way a handle goes."""

from __future__ import annotations

from dataclasses import replace
from math import cos, exp, sin, sqrt

import numpy as np
import pytest
from hapticd.experiments.hands import Session, Tally, session
from hapticd.experiments.hands_command import as_json, table
from hapticd.experiments.ideal_twin import SAMPLE_S, Covered, IdealTwin, ideal_twin, length
from hapticd.experiments.random_hand import stranger
from hapticd.experiments.temper import Temper
from hapticd.models import Array, Robot
from hapticd.runtime.configuration.config import BETWEEN, load
from hapticd.runtime.configuration.session import build
from hapticd.runtime.configuration.system import find_system
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.sim.hand import Path, PointHand

SECONDS = 8.0


def held_at(place: tuple[float, ...], stiffness: float, damping: float, strength: float) -> PointHand:
    return PointHand(Path([0.0, 9.0], np.array([place, place])), stiffness, damping, strength)


def test_a_hand_that_pulls_swings_a_free_mass_as_the_closed_form_says() -> None:
    mass, damping, k, d = 4.0, 8.0, 300.0, 10.0
    way = IdealTwin(mass, damping, held_at((0.1, 0.0, 0.0), k, d, 100.0)).way((0.0, 0.0, 0.0), 0.0, 2.0)
    decay = 0.5 * (d + damping) / mass
    omega = sqrt(k / mass - decay**2)
    for i, (x, y, z) in enumerate(way):
        t = i * SAMPLE_S
        true = 0.1 * (1.0 - exp(-decay * t) * (cos(omega * t) + decay / omega * sin(omega * t)))
        assert x == pytest.approx(true, abs=6e-4) and y == z == 0.0
    assert len(way) == 101 and way[:, 0].max() > 0.12


def test_a_hand_at_its_strength_drags_it_as_fast_as_damping_lets_it() -> None:
    way = IdealTwin(2.0, 10.0, held_at((0.0, 9.0, 0.0), 1000.0, 0.0, 5.0)).way((0.0,) * 3, 0.0, 4.0)
    assert (way[-1] - way[-2])[1] == pytest.approx(5.0 / 10.0 * SAMPLE_S, rel=1e-3)


def test_it_stops_at_the_walls_of_its_box_and_glides_along_them() -> None:
    twin = IdealTwin(
        2.0, 5.0, held_at((1.0, 1.0, -1.0), 500.0, 30.0, 40.0), (-0.5, -2.0, 0.2), (0.5, 2.0, 2.0)
    )
    way = twin.way((0.0, 0.0, 0.1), 0.0, 4.0)
    assert way[-1] == pytest.approx((0.5, 1.0, 0.1), abs=1e-3)  # it began below the box, and goes no deeper
    assert way.max(axis=0)[0] == 0.5 and way.min(axis=0)[2] == 0.1


class Bench:
    """A simulated Panda whose handle goes its own way while the machine is ACTIVE."""

    def __init__(self) -> None:
        loaded = load("panda")
        robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
        config = stranger(loaded.config, find_system("arm"), robot, 3, SECONDS, Temper())
        self.lockstep = Lockstep(build(replace(loaded, config=config)))
        limits = self.lockstep.session.system.limits(config).specs
        twin = ideal_twin(config, limits)
        assert twin is not None and min(twin.lower) > -1.0 and max(twin.upper) < 1.0
        self.begin: list[float] = [*config.simulation.hand.path[0].position]  # type: ignore[union-attr]
        self.way = twin.way(self.begin, 0.0, SECONDS)

    def share(self, places: Array, stopped: bool = False) -> float | None:
        """Of places that are taken one a tick from the beginning on."""
        covered, plant = Covered(self.lockstep), self.lockstep.plant
        self.lockstep.session.cycle.phase.mode = Mode.ACTIVE
        for k, place in enumerate(places):
            plant.time = (k + 1) / self.lockstep.session.config.loop.rate  # type: ignore[misc]
            plant.hand._handle[:] = place  # type: ignore[attr-defined]
            covered.add()
        return covered.share(SECONDS, stopped)


def test_who_follows_covers_all_of_it_who_stands_still_nothing_and_trembling_is_no_way() -> None:
    bench = Bench()
    assert length(bench.way) > 0.5
    ticks, times = np.arange(8000) * 1e-3, np.arange(len(bench.way)) * SAMPLE_S
    followed = np.stack([np.interp(ticks, times, axis) for axis in bench.way.T], axis=1)
    assert bench.share(followed) == pytest.approx(1.0, abs=0.01)
    still = np.tile(bench.begin, (8000, 1))
    assert bench.share(still) == 0.0
    tremble = 1e-4 * np.sin(2.0 * np.pi * 90.0 * ticks + 0.3)
    trembling = still + tremble[:, None]
    assert length(trembling) > 0.5 * length(bench.way)
    assert bench.share(trembling) == pytest.approx(0.0, abs=0.1)
    assert bench.share(bench.begin + 3.0 * (followed - bench.begin)) == 1.0  # too far is no more than all


def test_who_stops_covers_no_more_of_what_a_hand_would_have_led_it_yet() -> None:
    bench = Bench()
    times = np.arange(len(bench.way)) * SAMPLE_S
    followed = np.stack([np.interp(np.arange(4000) * 1e-3, times, axis) for axis in bench.way.T], axis=1)
    half = length(bench.way[: len(bench.way) // 2]) / length(bench.way)
    assert half < 0.7 and bench.share(followed, stopped=True) == pytest.approx(half, abs=0.02)
    assert (bench.share(followed[:0], stopped=True), bench.share(followed[:0])) == (0.0, None)


def test_a_giant_follows_the_hand() -> None:
    found = session(load("giant"), 2, 6.0, Temper())
    assert found.stop == "" and found.covered is not None and 0.95 < found.covered <= 1.0


@pytest.mark.parametrize("machine", ["rhi", f"giant{BETWEEN}door"])
def test_machines_that_render_no_free_mass_have_no_such_figure(machine: str) -> None:
    loaded = load(machine)
    lockstep = Lockstep(build(loaded))
    assert ideal_twin(loaded.config, lockstep.session.system.limits(loaded.config).specs) is None
    covered = Covered(lockstep)
    lockstep.session.cycle.phase.mode = Mode.ACTIVE
    covered.add()
    assert covered.share(1.0, True) is None


def test_the_figure_is_the_mean_of_the_sessions_that_have_one() -> None:
    tally = Tally()
    tally.add(Session(1, "", "", 0, 9.0))
    assert tally.covered is None and "covered" not in as_json(tally, "")
    for share in (0.9, 0.5):
        tally.add(Session(2, "", "", 0, 9.0, covered=share))
    assert tally.covered == pytest.approx(0.7)
    assert as_json(tally, "").endswith(',"covered":0.7}')
    assert any("70.0 % (least 50.0 %)" in line for line in table(tally))
