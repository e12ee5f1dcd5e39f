"""A network in virtual time: what is lost, late or overtaken, the same with the same seed."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.sim.network_model import Conditions, NetworkModel

DT = 1e-3


def exchange(
    conditions: Conditions, seed: int, ticks: int
) -> tuple[NetworkModel, list[tuple[int, int, float]]]:
    """What arrived at which tick: (tick, number of the packet, age)."""
    network, heard = NetworkModel(conditions, seed), []
    here, there = network.ports
    for tick in range(ticks):
        here.send(tick.to_bytes(4, "little"))
        network.advance(DT)
        if (received := there.receive()) is not None:
            heard.append((tick, int.from_bytes(received.payload, "little"), received.age))
    return network, heard


def test_an_ideal_one_brings_every_packet_a_tick_later() -> None:
    _, heard = exchange(Conditions(), 1, 100)
    assert [(number, round(age, 6)) for _, number, age in heard] == [(tick, DT) for tick in range(100)]


def test_delay_and_jitter_are_those_that_are_asked_for_and_nothing_goes_back() -> None:
    conditions = Conditions(0.12, 0.04)
    network, heard = exchange(conditions, 2, 4000)
    ages = np.array([age for _, _, age in heard])
    assert ages.min() >= 0.08 and ages.max() <= conditions.longest + 2 * DT
    numbers = [number for _, number, _ in heard]
    assert numbers == sorted(set(numbers)), "the newest only, each once"
    assert network.there.overtaken > 1000


@pytest.mark.parametrize(("loss", "burst"), [(0.05, 1.0), (0.05, 10.0), (0.3, 4.0)])
def test_losses_have_the_share_and_the_length_that_are_asked_for(loss: float, burst: float) -> None:
    ticks = 60_000
    _, heard = exchange(Conditions(0.0, 0.0, loss, burst), 3, ticks)
    came = np.zeros(ticks, bool)
    came[[number for _, number, _ in heard]] = True
    assert 1.0 - came.mean() == pytest.approx(loss, rel=0.15)
    runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], ~came, [0]]).astype(int))))[::2]
    assert runs.mean() == pytest.approx(burst if burst > 1.0 else 1.0 / (1.0 - loss), rel=0.15)


def test_nothing_comes_through_an_outage_and_all_after_it() -> None:
    _, heard = exchange(Conditions(outages=[(0.05, 0.08)]), 4, 200)
    missing = sorted(set(range(200)) - {number for _, number, _ in heard})
    assert missing == list(range(50, 80))


def test_the_same_seed_is_the_same_network_and_its_directions_differ() -> None:
    conditions = Conditions(0.01, 0.005, 0.1)
    first, again, other = (exchange(conditions, seed, 500)[1] for seed in (5, 5, 6))
    assert first == again != other
    network = NetworkModel(conditions, 5)
    draws = [each._random.random(3).tolist() for each in (network.there, network.back)]
    assert draws[0] != draws[1]


@pytest.mark.parametrize("wrong", [{"jitter": 0.1}, {"loss": 1.0}, {"loss": -0.1}, {"burst": 0.5}])
def test_a_network_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="is"):
        Conditions(**wrong)
