"""The bounds on springs and dampers are those at which a simulated one runs away."""

import numpy as np
import pytest
from hapticd.runtime.core.sampling import controls, fastest, integrates


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
