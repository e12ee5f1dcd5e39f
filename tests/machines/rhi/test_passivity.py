"""The energy tank: whatever the posture makes of the force, the hand gets back no more than it has put in."""

import numpy as np
import pytest
from hapticd.machines.rhi.passivity import GAIN, SPARE, Tank

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
        force = [max(share * f, -most) for f in demand]
        tank.render(force)
        forces.append(-force[1])
    return np.array(forces), np.array(work)


def press(depth: float, ticks: int = 1000) -> np.ndarray:
    return depth * np.sin(np.pi * np.arange(ticks + 1) / ticks)


def test_a_wall_that_is_rendered_as_it_is_does_not_notice_the_tank() -> None:
    """Frozen postures, too: motors that saturate at the same force on both ways."""
    depths = press(0.02)
    forces, _ = rendered(depths, np.full(len(depths), 100.0))
    # sampled, it gives back a little more than it takes: that is held back where the hand leaves it
    np.testing.assert_allclose(forces[:970], K * np.maximum(depths[:970], 0.0), rtol=1e-12)
    assert (forces[970:] <= K * np.maximum(depths[970:], 0.0)).all()
    forces, work = rendered(depths, np.full(len(depths), 4.8))
    np.testing.assert_allclose(forces[:970], np.minimum(K * np.maximum(depths[:970], 0.0), 4.8), rtol=1e-12)
    assert work[-1] <= 1.001 * SPARE


@pytest.mark.parametrize("depth", [0.01, 0.02, 0.04])
def test_a_posture_that_turns_to_strong_while_the_hand_presses_gives_nothing_back(depth: float) -> None:
    """4.8 N on the way in, up to 12 N on the way out: without the tank far too much."""
    depths = press(depth)
    strong = np.where(np.arange(len(depths)) < 500, 4.8, 12.0)
    forces, work = rendered(depths, strong)
    put_in = -work.min()
    active = np.trapezoid(np.minimum(K * depths, strong), depths)
    assert active < -0.2 * put_in  # what the demand would give away: this test has something to find
    assert work[-1] <= 1.001 * SPARE < 0.02 * put_in
    # the hand feels all of it until it goes back, and no jump on the way out
    assert forces[501] > 0.98 * min(K * depth, 12.0, 2.0 * GAIN * put_in / depth)
    assert np.abs(np.diff(forces[505:])).max() < 0.1
    assert forces[-1] < 0.1


def test_no_course_of_the_hand_and_of_the_posture_gets_more_out_than_was_put_in() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        steps = rng.standard_normal(3000) * 2e-4 + 5e-5
        depths = np.abs(np.cumsum(steps)) * np.hanning(3000)  # closed: begins and ends at the surface
        strength = np.clip(6.0 + 0.2 * np.cumsum(rng.standard_normal(3000)), 1.0, 12.0)
        _, work = rendered(depths, strength)
        assert work.max() <= 2.0 * SPARE * (1 + np.count_nonzero(np.diff(np.sign(depths - 1e-6)) > 0))


def test_on_the_way_out_the_energy_falls_as_a_power_of_the_potential() -> None:
    """Closed form of dE = -F dx with F = 2 GAIN E / d."""
    tank = Tank(1)
    spring = wall((0.0,), (1.0,), K)
    start, n = 0.01, 20000
    spring.force([start])
    tank.update([start], spring.energy)
    tank.energy = begin = 0.2 * spring.energy
    energies = []
    for depth in np.linspace(start, 0.2 * start, n):
        demand = spring.force([float(depth)])
        share = tank.update([float(depth)], spring.energy)
        tank.render([share * demand[0]])
        energies.append(tank.energy + SPARE)
    power = np.linspace(1.0, 0.2, n) ** (2.0 * GAIN)
    np.testing.assert_allclose(energies, (begin + SPARE) * power, rtol=5e-3)


def test_what_is_left_at_the_surface_is_not_kept_for_the_next_time() -> None:
    tank = Tank(1)
    tank.update([0.01], 0.05)
    tank.render([-10.0])
    tank.update([0.02], 0.2)
    assert tank.energy == pytest.approx(0.1)
    assert tank.update([-0.001], 0.0) == 1.0 and tank.energy == 0.0
