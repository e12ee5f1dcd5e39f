"""The energy tank: whatever the posture makes of the force, the hand gets back no more than it has put in."""

import numpy as np
import pytest
from hapticd.machines.rhi.passivity import FADE, GAIN, PLAY, SPARE, STEEP, Tank

from .rhi_device import wall

K = 1000.0


def rendered(depths: np.ndarray, strength: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces along the wall's normal, of motors so strong, and their work on a hand at these depths."""
    spring, tank = wall((0.0, 0.0), (0.0, 1.0), K), Tank(2)
    forces, work, force, before = [], [0.0], [0.0, 0.0], depths[0]
    for depth, most in zip(depths, strength, strict=True):
        work.append(work[-1] + force[1] * (depth - before))
        before = depth
        demand = spring.force([0.3, float(depth)])
        share = tank.update([0.3, float(depth)], spring.energy)
        alpha = min(share, most / max(-demand[1], 1e-9))
        force = [alpha * f for f in demand]
        tank.render(force, alpha)
        forces.append(-force[1])
    return np.array(forces), np.array(work)


def press(depth: float, ticks: int = 1000) -> np.ndarray:
    return depth * np.sin(np.pi * np.arange(ticks + 1) / ticks)


def test_a_wall_that_is_rendered_as_it_is_does_not_notice_the_tank() -> None:
    """Frozen postures, too: motors that saturate at the same force on both ways."""
    depths = press(0.02)
    forces, _ = rendered(depths, np.full(len(depths), 100.0))
    # sampled, it gives back a little more than it takes: that is held back where the hand leaves it
    np.testing.assert_allclose(forces[:950], K * np.maximum(depths[:950], 0.0), rtol=1e-12)
    assert (forces[950:] <= K * np.maximum(depths[950:], 0.0)).all()
    forces, work = rendered(depths, np.full(len(depths), 4.8))
    np.testing.assert_allclose(forces[:950], np.minimum(K * np.maximum(depths[:950], 0.0), 4.8), rtol=1e-12)
    assert work[-1] <= 1.01 * SPARE


@pytest.mark.parametrize("depth", [0.01, 0.02, 0.04])
def test_a_posture_that_turns_to_strong_while_the_hand_presses_gives_nothing_back(depth: float) -> None:
    """4.8 N on the way in, up to 12 N on the way out: without the tank far too much."""
    depths = press(depth)
    strong = np.where(np.arange(len(depths)) < 500, 4.8, 12.0)
    forces, work = rendered(depths, strong)
    put_in = -work.min()
    active = np.trapezoid(np.minimum(K * depths, strong), depths)
    assert active < -0.2 * put_in  # what the demand would give away: this test has something to find
    assert work[-1] <= 1.01 * SPARE < 0.02 * put_in
    # the hand feels all of it until it goes back, and no jump on the way out
    assert forces[501] > 0.98 * min(K * depth, 12.0, 4.0 * put_in / depth)
    assert np.abs(np.diff(forces[505:])).max() < 0.15
    assert forces[-1] < 0.1


def test_no_course_of_the_hand_and_of_the_posture_gets_more_out_than_was_put_in() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        steps = rng.standard_normal(3000) * 2e-4 + 5e-5
        depths = np.abs(np.cumsum(steps)) * np.hanning(3000)  # closed: begins and ends at the surface
        strength = np.clip(6.0 + 0.2 * np.cumsum(rng.standard_normal(3000)), 1.0, 12.0)
        _, work = rendered(depths, strength)
        assert work.max() <= 2.0 * SPARE * (1 + np.count_nonzero(np.diff(np.sign(depths - 1e-6)) > 0))


@pytest.mark.parametrize("end", [0.9, 0.55, 0.2])
def test_on_the_way_out_the_share_falls_to_one_that_leaves_nothing_at_the_surface(end: float) -> None:
    """Closed form of dE = s dU with u = U / U0: s U = GAIN E down to u = PLAY, then s ~ u^STEEP until
    s U = FADE E, and so on from there."""
    tank, spring = Tank(1), wall((0.0,), (1.0,), K)
    start, n, begin = 0.01, 20000, 0.2
    spring.force([start])
    tank.update([start], spring.energy)
    whole = spring.energy
    tank.energy = begin * whole - SPARE
    for depth in np.linspace(start, np.sqrt(end) * start, n):
        demand = spring.force([float(depth)])
        share = tank.update([float(depth)], spring.energy)
        tank.render([share * demand[0]], share)
    left = begin * PLAY**GAIN
    first = GAIN * left / PLAY
    # left (u / PLAY) = left + b ((u / PLAY)^(STEEP + 1) - 1) meets s u / FADE
    b = first * PLAY / (STEEP + 1.0)
    meet = ((left - b) / (first * PLAY / FADE - b)) ** (1.0 / (STEEP + 1.0))
    u = end / PLAY
    if u > 1.0:
        energy, expected = begin * end**GAIN, GAIN * begin * end ** (GAIN - 1.0)
    elif u > meet:
        energy, expected = left + b * (u ** (STEEP + 1.0) - 1.0), first * u**STEEP
    else:
        energy = (left + b * (meet ** (STEEP + 1.0) - 1.0)) * (u / meet) ** FADE
        expected = FADE * energy / end
    assert tank.energy + SPARE == pytest.approx(energy * whole, rel=5e-3)
    assert share == pytest.approx(expected, rel=5e-3)


def test_on_the_way_in_the_hand_gets_back_what_it_had_lost_of_the_share() -> None:
    """Out to a third of the depth, against motors that have become strong, and in again: less, then all."""
    depths = np.concatenate([press(0.02)[:501], np.linspace(0.02, 0.007, 400), np.linspace(0.007, 0.02, 400)])
    strong = np.where(np.arange(len(depths)) < 500, 4.8, 20.0)
    forces, work = rendered(depths, strong)
    share = forces / (K * np.maximum(depths, 1e-6))
    assert 0.1 < share[900] < 0.4 and share[-1] > 0.99
    assert np.abs(np.diff(share[500:])).max() < 0.02
    assert work.max() <= SPARE


def test_what_is_left_at_the_surface_is_not_kept_for_the_next_time() -> None:
    tank = Tank(1)
    tank.update([0.01], 0.05)
    tank.render([-10.0], 1.0)
    tank.update([0.02], 0.2)
    assert tank.energy == pytest.approx(0.1)
    assert tank.update([-0.001], 0.0) == 1.0 and tank.energy == 0.0
