"""A twin fades out as its closed form says, gives a hand nothing, and another begins where it stood."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.control.chain import LOCKED, Gains, Horizons
from hapticd.control.force_control import ForceControl
from hapticd.control.limits import Limits
from hapticd.control.twin import CartesianTwin
from hapticd.control.twin_exchange import FADE_OUT_S, FADED, PATIENCE_S, REST, TwinExchange
from hapticd.machines.rendering.twin import twin_of
from hapticd.models import Robot
from hapticd.runtime.configuration import config

DT = 1e-3
FADE_IN_S = 0.5
POSTURE = np.array([0.3, 1.4, -0.67, 0.6, 0.5, 0.1])
FREE = Limits(np.full(6, -np.inf), np.full(6, np.inf), np.full(6, 20.0), np.full(6, 1e4))
CONFIGURED: Any = config.load("giant with mass,door,excavator").config
MASS, DOOR, EXCAVATOR = range(3)
MOST_JUMP = 0.1
"""Of the handle's acceleration from tick to tick, where its twin is exchanged [m/s^2, rad/s^2 by 0.2 m]."""


class Bench:
    """A giant's arm without limits, which renders one of three twins."""

    def __init__(self, damping: float | None = None) -> None:
        robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
        twins = [twin_of(section) for section in CONFIGURED.twins.values()]
        if damping is not None:
            twins[MASS] = CartesianTwin(4.0, 0.06, damping, damping, (30.0, 80.0), (600.0, 2e3))
        gains, horizons = Gains(100.0, 100.0, 20.0, 20.0), Horizons(5e-3, 15e-3)
        self.control = ForceControl(robot, FREE, twins, [], [], gains, "gauss", DT, horizons)
        self.control.reset(POSTURE)
        self.exchange = TwinExchange(self.control, FADE_IN_S, DT)
        self.twists: list[np.ndarray] = []

    def tick(self, wrench: np.ndarray) -> None:
        control = self.control
        self.exchange.update()
        control.prepare(wrench)
        assert control.assemble() and control.optimise()
        control.advance()
        self.twists.append(control.handle.J @ control.qd)

    def until_exchanged(self, wrench: Callable[[], np.ndarray]) -> int:
        for ticks in range(round(1.0 / DT)):
            if self.exchange.wanted < 0:
                return ticks
            self.tick(wrench())
        raise AssertionError(self.control.twin.twist)


def moving(bench: Bench, twist: np.ndarray) -> np.ndarray:
    """Twin and arm with a twist (6,), as far as the twin can have it."""
    control = bench.control
    control.prepare(np.zeros(6))
    control.twin.qd[:] = np.linalg.lstsq(control.twin.J, twist, rcond=None)[0]
    control.qd[:] = np.linalg.solve(control.handle.J, control.twin.J @ control.twin.qd)
    return control.twin.J @ control.twin.qd


def test_without_a_force_the_speed_falls_as_the_share_does() -> None:
    bench = Bench(damping=0.0)
    twist = moving(bench, np.array([0.3, -0.2, 0.05, 0.1, 0.2, -0.3]))
    bench.exchange.begin(DOOR)
    for k in range(1, round(2.0 * FADE_OUT_S / DT)):
        bench.tick(np.zeros(6))
        share = np.exp(-0.5 * (k * DT / FADE_OUT_S) ** 2)
        assert bench.control.share[0] == pytest.approx(share)
        np.testing.assert_allclose(bench.control.twin.twist, share * twist, atol=5e-3 * np.abs(twist).max())


@pytest.mark.parametrize("seed", [3, 4])
def test_a_fade_out_gives_a_hand_no_more_than_the_motion_held(seed: int) -> None:
    """Hands that push and pull at random, on a mass that nothing damps: work and kinetic energy."""
    random, bench = np.random.default_rng(seed), Bench(damping=0.0)
    M = np.repeat([4.0, 0.06], 3)
    twist = moving(bench, random.uniform(-0.5, 0.5, 6))
    held = 0.5 * float(M @ twist**2)
    bench.exchange.begin(DOOR)
    work, wrench = 0.0, np.zeros(6)
    for k in range(600):
        if k % 40 == 0:
            wrench = random.uniform(-1.0, 1.0, 6) * [20.0, 20.0, 20.0, 1.0, 1.0, 1.0]
        before = bench.twists[-1] if bench.twists else twist
        bench.tick(wrench)
        work += DT * float(wrench @ (before + bench.twists[-1])) / 2.0
        assert -work <= held * 1.001
        if bench.exchange.wanted < 0:
            break
    assert bench.control.rendered == DOOR


@pytest.mark.parametrize(("first", "second"), [(MASS, DOOR), (DOOR, EXCAVATOR), (EXCAVATOR, MASS)])
def test_where_a_twin_is_exchanged_nothing_jumps(first: int, second: int) -> None:
    bench = Bench()
    control = bench.control
    control.exchange(first)
    wrench = np.array([20.0, 25.0, -15.0, 0.5, 1.0, -0.5])
    for _ in range(150):
        bench.tick(wrench)
    bench.exchange.begin(second)
    ticks = bench.until_exchanged(lambda: wrench)
    assert 3.0 * FADE_OUT_S < ticks * DT < 6.0 * FADE_OUT_S
    assert control.rendered == second and control.share[0] == 0.0
    for _ in range(100):
        bench.tick(wrench)
    assert control.share[0] == pytest.approx(0.2, abs=3e-3)
    acceleration = np.diff(bench.twists, axis=0) / DT
    jumps = np.abs(np.diff(acceleration, axis=0))[150 + ticks - 4 : 150 + ticks + 4]
    assert jumps.shape[0] == 8
    assert jumps[:, :3].max() < MOST_JUMP and jumps[:, 3:].max() < MOST_JUMP / 0.2


def test_another_twin_begins_at_rest_where_the_last_one_stood() -> None:
    bench = Bench()
    for _ in range(300):
        bench.tick(np.array([10.0, 5.0, 0.0, 0.2, 0.0, 0.4]))
    control = bench.control
    place, rotation = control.twin.position.copy(), control.twin.rotation.copy()
    control.exchange(DOOR)
    np.testing.assert_allclose(control.twin.position, place, atol=1e-12)
    np.testing.assert_allclose(control.twin.rotation, rotation, atol=1e-12)
    assert not control.twin.twist.any() and not control.active.any()
    assert control.twin.q.tolist() == [0.0, -0.05] and control.twin.held is not None
    assert control.twin.held[0] == LOCKED


def test_a_twin_that_something_else_moves_stays() -> None:
    bench = Bench()
    bench.exchange.begin(DOOR)
    ticks = 0
    while bench.exchange.wanted >= 0:
        bench.control.twin.qd[0] = 3.0 * REST[0]
        bench.tick(np.zeros(6))
        ticks += 1
    assert ticks * DT == pytest.approx(PATIENCE_S, abs=2.0 * DT)
    assert "does not come to rest" in bench.exchange.abandoned
    assert bench.control.rendered == MASS and bench.control.slowing == 0.0
    shares = []
    for _ in range(round(FADE_IN_S / DT) + 2):
        bench.tick(np.zeros(6))
        shares.append(float(bench.control.share[0]))
    assert shares[-1] == 1.0 and all(b - a <= 1.001 * DT / FADE_IN_S for a, b in pairwise(shares))


def test_a_fade_that_is_asked_for_while_another_fades_in_begins_from_there() -> None:
    bench = Bench()
    bench.exchange.begin(DOOR)
    bench.until_exchanged(lambda: np.zeros(6))
    for _ in range(300):
        bench.tick(np.zeros(6))
    share = float(bench.control.share[0])
    bench.exchange.begin(MASS)
    bench.tick(np.zeros(6))
    assert 0.55 < share < 0.65 and float(bench.control.share[0]) == pytest.approx(share, rel=1e-3)
    bench.until_exchanged(lambda: np.zeros(6))
    assert bench.control.rendered == MASS
    bench.exchange.reset()
    assert bench.control.share[0] == 1.0


def test_a_pushed_mass_does_not_go_before_its_forces_have_faded() -> None:
    """At the turn of its motion it rests for a tick, under its full force."""
    bench = Bench()
    bench.exchange.begin(DOOR)
    bench.tick(np.array([40.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert np.abs(bench.control.twin.twist).max() > REST[0]
    bench.control.twin.qd[:] = 0.0
    bench.tick(np.zeros(6))
    assert bench.control.rendered == MASS and bench.control.share[0] > FADED
