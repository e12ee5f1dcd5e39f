"""The bounds on springs and dampers are those at which a simulated one runs away."""

import numpy as np
import pytest
from hapticd.runtime.core.sampling import controls, fastest, integrates, steady


def swings(stiffness: float, damping: float, h: float) -> float:
    """Largest excursion of a unit mass after many steps of symplectic Euler."""
    x, v = 1.0, 1000.0
    for _ in range(400):
        v -= h * (stiffness * x + damping * v)
        x += h * v
    return abs(x) + h * abs(v)


@pytest.mark.parametrize(("stiffness", "damping"), [(3.9e6, 0.0), (1e6, 1450.0), (0.0, 1990.0), (2e6, 900.0)])
def test_integration_runs_away_just_beyond_the_bound_and_not_before(stiffness: float, damping: float) -> None:
    assert integrates(stiffness, damping, 1e-3) and swings(stiffness, damping, 1e-3) < 300.0
    beyond = 4.0 / (1e-6 * stiffness + 2e-3 * damping) * 1.02
    assert not integrates(beyond * stiffness, beyond * damping, 1e-3)
    assert swings(beyond * stiffness, beyond * damping, 1e-3) > 1e5


def test_a_damper_that_comes_a_period_late_runs_away_beyond_the_bound() -> None:
    for damping, stable in ((990.0, True), (1010.0, False)):
        v, late = 1.0, 1.0
        for _ in range(3000):
            v, late = v - 1e-3 * damping * late, v
        assert controls(0.0, damping, 1e-3) is stable is (abs(v) < 1.0)


def test_the_fastest_mode_is_that_of_the_product() -> None:
    rng = np.random.default_rng(1)
    root = rng.standard_normal((4, 4))
    inverse, gains = root @ root.T, rng.uniform(0.0, 3.0, 4)
    assert fastest(inverse, gains) == pytest.approx(np.linalg.eigvals(inverse * gains).real.max())


@pytest.mark.parametrize(("hz", "stable"), [(200.0, False), (215.0, False), (235.0, True), (1000.0, True)])
def test_a_motor_behind_a_spring_swings_up_where_its_gains_come_too_late(hz: float, stable: bool) -> None:
    """Joint 1 of the Panda, in steps so short that each is exact enough."""
    inertia, spring, p, d, steps = 0.6, 12000.0, 2400.0, 72.0, 200
    x, v, torque, most = 1e-3, 0.0, 0.0, 0.0
    for k in range(1200):
        torque, later = -p * x - d * v, torque
        h = 1.0 / (hz * steps)
        for _ in range(steps):
            v += h * (later - spring * x) / inertia
            x += h * v
        most = max(most, abs(x)) if k > 1100 else most
    assert steady(p / inertia, d / inertia, spring / inertia, 1.0 / hz) is stable is (most < 1e-3)


def test_a_motor_that_nothing_springs_back_is_judged_as_well() -> None:
    assert steady(4000.0, 120.0, 0.0, 2e-3)
    assert not steady(4000.0, 520.0, 0.0, 2e-3)
