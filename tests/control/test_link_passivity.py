"""The layer in contact over networks, judged by what the simulation counts, not by its own books."""

from dataclasses import replace

import numpy as np
import pytest
from hapticd.control.avatar_law import Impedance
from hapticd.control.link_passivity import DEBT, DRIFT, EMPTY, FILLS, AvatarPort, OperatorPort, Tank
from hapticd.experiments.contact_in_space import press_in_space
from hapticd.experiments.contact_over_link import Network, Press, Verdict, judge, press, random_case

NETWORKS = {"120+-40 ms, 5 % lost": Network(0.06, 0.02, 0.05), "700 ms": Network(0.35)}
DT = 1e-3


def fine(verdict: Verdict) -> None:
    assert verdict.swing < 1e-3
    assert verdict.force <= 30.0
    assert verdict.given <= 0.1
    assert verdict.share >= 0.5 and verdict.pressed > 3.0


@pytest.mark.parametrize("network", NETWORKS)
@pytest.mark.parametrize("wall", [1e3, 3e3, 1e4])
def test_contact_is_stable_for_a_minute_with_the_layer_and_not_without(network: str, wall: float) -> None:
    case, net = Press(wall), NETWORKS[network]
    fine(judge(case, press(case, net, net, 60.0, 1, True)))
    without = press(case, net, net, 20.0, 1, False)
    worst = judge(case, without)
    assert worst.swing > 0.05 and worst.force > 30.0 and worst.given > 10.0


@pytest.mark.parametrize("network", NETWORKS)
def test_in_space_too(network: str) -> None:
    case, net = Press(1e4), NETWORKS[network]
    fine(judge(case, press_in_space(case, net, net, 20.0, 1, True)))
    worst = judge(case, press_in_space(case, net, net, 20.0, 1, False))
    assert worst.swing > 0.05 and worst.force > 30.0


@pytest.mark.parametrize("seed", [1001, 1002, 1003])
def test_other_hands_walls_and_networks(seed: int) -> None:
    case, net = random_case(seed)
    fine(judge(case, press(case, net, net, 20.0, seed, True)))


def test_without_delay_free_motion_is_left_alone() -> None:
    """A tool of half a kilogram swings to and fro in the air; its inertia is felt."""
    case = replace(Press(1e4), depth=-0.02, period=3.0, speed=0.15, tool=0.5)
    net = Network(0.0)
    seen = press(case, net, net, 12.0, 1, True)
    assert not seen.world.any() and np.abs(seen.felt).max() > 0.1
    assert seen.taken[-1] < 0.02 * seen.work


def operator(tank: Tank) -> tuple[OperatorPort, np.ndarray]:
    twist = np.zeros(6)
    return OperatorPort(np.eye(3), twist, DT, tank), twist


def test_what_leaves_a_tank_is_what_was_in_it() -> None:
    """Random wrenches and motions: the work on the hand never exceeds the start and what was granted."""
    port, twist = operator(Tank(begin=0.04))
    rng, work, granted, before = np.random.default_rng(1), 0.0, 0.0, np.zeros(6)
    least = 0.0
    for k in range(20_000):
        if k % 50 == 0:
            port.wrench[:], target = 20.0 * rng.standard_normal(6), 0.1 * rng.standard_normal(6)
        twist += 0.05 * (target - twist)
        work += 0.5 * DT * float(port.felt @ (twist + before))
        before = twist.copy()
        granted += 1e-5 * float(rng.uniform())
        port.update(granted)
        least = min(least, 0.04 + granted - work)
    assert least > -0.02  # a tick of what nobody can foresee
    assert port.taken > 1.0


def test_energy_that_was_granted_counts_once_however_packets_come() -> None:
    port, _ = operator(Tank(begin=0.0, keep=1.0))
    for granted in (0.1, 0.3, 0.2, 0.3, 0.1):
        port.update(granted)
    assert port.level == pytest.approx(0.3)


def test_a_tank_hands_over_what_it_does_not_keep_and_spills_over_its_rim() -> None:
    port, _ = operator(Tank(begin=0.5, keep=0.1, most=0.5))
    port.update(1.0)
    for _ in range(2000):
        port.update(1.0)
    assert port.level == pytest.approx(0.1, abs=1e-6)
    assert port.sent + port.level + port.spilt == pytest.approx(1.5)
    assert port.spilt > 0.5


def test_only_the_part_along_the_motion_is_taken() -> None:
    port, twist = operator(Tank(begin=0.0))
    twist[0], port.wrench[:] = 0.1, [5.0, 7.0, 0.0, 0.0, 0.0, 1.0]
    port.update(0.0)
    np.testing.assert_allclose(port.felt, [0.0, 7.0, 0.0, 0.0, 0.0, 1.0], atol=1e-9)
    assert port.why == EMPTY | FILLS and port.damping == pytest.approx(50.0)
    twist[0] = -0.1  # against it: felt in full, and the tank fills
    port.update(0.0)
    np.testing.assert_allclose(port.felt, port.wrench + np.array([0.6, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert port.why == FILLS and not port.why & DEBT


def test_a_reference_that_was_held_back_returns_without_a_jump() -> None:
    twist, felt = np.zeros(6), np.zeros(6)
    port = AvatarPort(np.eye(3), twist, felt, Impedance(), DT)
    port.reset()
    felt[0] = -15.0
    for k in range(1000):
        port.position[0] = 5e-5 * k
        port.update(0.0)
    assert port.drift[0] > 0.02 and port.why & DRIFT and port.taken > 0.1
    felt[0], before, fastest = 0.0, port.reference.copy(), 0.0
    for _ in range(3000):
        port.update(0.0)
        fastest = max(fastest, float(np.abs(port.reference - before).max()) / DT)
        before = port.reference.copy()
    assert np.abs(port.drift).max() < 1e-3 and fastest <= 0.1 + 1e-9 and not port.why


def test_a_tank_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(ValueError, match="keep from 0 to most"):
        Tank(keep=2.0)
