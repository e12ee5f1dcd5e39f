"""What keeps the handle of a rendered twin passive."""

import numpy as np
import pytest
from hapticd.control.handle_passivity import ALLOWED, BAND, MOST, RELEASE_S, HandlePassivity

DT = 1e-3


def trembling(
    late: float, seconds: float = 1.5, frequency: float = 15.0, size: float = 0.02, mass: float = 4.0
) -> tuple[HandlePassivity, float]:
    """A mass [kg] without damping that a hand swings [m/s], felt late [s], and the work of the layer [J]."""
    passivity, work = HandlePassivity(DT), 0.0
    w = 2.0 * np.pi * frequency
    for t in DT * np.arange(round(seconds / DT)):
        wrench, twist, ahead = np.zeros(6), np.zeros(6), np.zeros(6)
        grown = min(1.0, t / 0.5)  # slowly, as what trembles does
        wrench[2], twist[2] = -grown * mass * size * w * np.sin(w * t), grown * size * np.cos(w * t)
        ahead[2] = grown * size / w * (np.sin(w * (t - late)) - np.sin(w * t))
        passivity.update(wrench, twist, ahead)
        work += float(passivity.wrench @ twist) * DT
    return passivity, work


@pytest.mark.parametrize("size", [0.02, 0.2])
def test_the_observed_lack_is_that_of_a_mass_felt_late(size: float) -> None:
    late, w = 2.5e-3, 2.0 * np.pi * 15.0
    passivity, _ = trembling(late, size=size)
    # Re(F / v) of a mass m behind a delay T is -m w sin(w T)
    assert passivity.lack[0] == pytest.approx(4.0 * w * np.sin(w * late), rel=0.1)
    assert passivity.lack[1] == 0.0


def test_the_damping_takes_energy_and_is_what_is_lacking() -> None:
    passivity, work = trembling(1e-3)
    lack = 4.0 * 2.0 * np.pi * 15.0 * np.sin(2.0 * np.pi * 15.0 * 1e-3)
    assert passivity.damping[0] == pytest.approx(lack - ALLOWED[0], rel=0.25)
    assert work < -0.5 * 0.5 * passivity.damping[0] * 0.02**2  # of 1.5 s most
    assert trembling(8e-3)[0].damping[0] == pytest.approx(MOST[0])


def test_a_passive_handle_is_left_alone() -> None:
    for late in (0.0, 1e-4):
        passivity, work = trembling(late)
        assert not passivity.damping.any() and work == 0.0


def test_noise_is_no_tremble() -> None:
    assert not trembling(8e-3, size=1e-4)[0].damping.any()


def test_slow_motion_feels_a_mass_at_most() -> None:
    passivity, _ = trembling(8e-3)
    force, speed = [], []
    for t in DT * np.arange(2000):
        twist = np.zeros(6)
        twist[2] = 0.3 * np.sin(2.0 * np.pi * 0.5 * t)
        passivity.update(np.zeros(6), twist, np.zeros(6))
        force.append(passivity.wrench[2])
        speed.append(twist[2])
    push = np.gradient(speed, DT) * MOST[0] / (2.0 * np.pi * BAND[0])
    assert np.abs(force[500:]).max() < 1.02 * np.abs(push).max()
    assert passivity.damping[0] == pytest.approx(MOST[0] * np.exp(-2.0 / RELEASE_S), rel=0.05)


def test_a_reset_forgets() -> None:
    passivity, _ = trembling(8e-3)
    passivity.reset()
    passivity.update(np.full(6, 5.0), np.zeros(6), np.full(6, 1e-3))
    assert not passivity.damping.any() and not passivity.lack.any()
