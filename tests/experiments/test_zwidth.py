"""How stiff a wall the giant renders."""

import numpy as np
import pytest
from hapticd.experiments import giant_zwidth as zwidth
from hapticd.experiments.giant_zwidth import Hand
from hapticd.experiments.haptify import Felt
from hapticd.machines.rendering.sections import ChainTwin
from hapticd.runtime.configuration import config

GIANT = config.load("giant")
HAND, RATE = Hand(900.0, 10.0), 1000.0


def trembling(growth: float, size: float = 0.1, stop: str = "") -> Felt:
    """A handle that swings with 15 Hz, ever more by a rate [1/s], from a speed [m/s] on."""
    t = np.arange(round(zwidth.PRESSED_S * RATE)) / RATE
    still = np.zeros((len(t), 3))
    velocity = still.copy()
    velocity[:, 2] = size * np.exp(growth * t) * np.cos(2.0 * np.pi * 15.0 * t)
    names = [name for name in Felt.__slots__ if name not in ("t", "velocity", "stop")]
    return Felt(t=t, velocity=velocity, stop=stop, **dict.fromkeys(names, still))


def test_a_wall_is_stable_where_what_trembles_dies_down() -> None:
    assert zwidth.stable(trembling(-1.0), HAND, RATE)
    assert not zwidth.stable(trembling(0.0), HAND, RATE)  # a limit cycle
    assert not zwidth.stable(trembling(1.0), HAND, RATE)
    assert zwidth.stable(trembling(0.0, 3e-4), HAND, RATE)  # the noise of the sensors
    assert not zwidth.stable(trembling(-1.0, stop="overloaded"), HAND, RATE)


def test_the_damping_of_the_hand_takes_what_a_swing_gives() -> None:
    # 10 N s/m take half of 10 x 0.1^2 on average
    assert zwidth.taken(trembling(0.0).part(0.0, 1.0), HAND, RATE) == pytest.approx(0.05, rel=1e-3)


@pytest.mark.parametrize("last", [0.0, *zwidth.WALLS])
def test_the_highest_wall_is_found(last: float) -> None:
    asked: list[float] = []

    def holds(wall: float) -> bool:
        asked.append(wall)
        return wall <= last

    assert zwidth.highest(zwidth.WALLS, holds) == last
    assert len(asked) <= 3


def test_the_machine_is_the_one_that_is_asked_for() -> None:
    asked = zwidth.machine(GIANT, 2.0, 8e3, Hand(3000.0, 40.0), 4000.0).config
    twin, hand = asked.giant.twin, asked.simulation.hand  # type: ignore[attr-defined, union-attr]
    assert isinstance(twin, ChainTwin)
    up = twin.joints["up"]
    assert (up.inertia, up.stiffness, up.range) == (2.0, 8e3, (-0.3, 0.3))
    assert (hand.stiffness, hand.damping, asked.loop.rate) == (3000.0, 40.0, 4000.0)


@pytest.mark.parametrize(("mass", "wall", "stable"), [(4.0, 16e3, True), (1.0, 32e3, False)])
def test_a_hand_taps_a_wall(mass: float, wall: float, stable: bool) -> None:
    felt = zwidth.pressed(GIANT, mass, wall, HAND, RATE)
    assert zwidth.stable(felt, HAND, RATE) == stable
    if stable:
        assert -felt.force[-1, 2] == pytest.approx(zwidth.PRESS, rel=0.02)
        assert felt.force[:, 2].max() < 0.0  # it never leaves the wall


def test_a_machine_that_watches_its_handle_holds_a_wall_that_trembles_without() -> None:
    felt = zwidth.pressed(GIANT, 1.0, 32e3, HAND, RATE, passivity=True)
    assert zwidth.stable(felt, HAND, RATE)
    assert -felt.force[-1, 2] == pytest.approx(zwidth.PRESS, rel=0.02)
