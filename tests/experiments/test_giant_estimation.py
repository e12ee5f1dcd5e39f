"""What the experiment calls noise and delay."""

from __future__ import annotations

import numpy as np
from hapticd.experiments.giant_estimation import JUDGED, Walk, differences, judge, low_passed, passed

DT = 1e-3


def walked(seconds: float = 4.0) -> Walk:
    t = DT * np.arange(round(seconds / DT))[:, None]
    w = 2.0 * np.pi * np.array([0.7, 1.0, 1.3, 1.9, 2.3, 3.1])
    true = np.stack([np.cos(w * t), -w * np.sin(w * t)])
    return Walk(np.stack([np.sin(w * t) / w] * 4), np.zeros((len(t), 6)), true.copy(), true, DT)


def test_a_delay_and_a_noise_are_found_as_they_were_put_in() -> None:
    walk, late = walked(), 3
    noise = 0.02 * np.random.default_rng(2).standard_normal(walk.true.shape)
    found = judge(np.roll(walk.true, late, axis=1) + noise, walk)
    for quantity in ("speed", "acceleration"):
        np.testing.assert_allclose(found[f"{quantity} late"], late, atol=0.2)
    np.testing.assert_allclose(found["fast speed"], 0.02, rtol=0.05)
    np.testing.assert_allclose(judge(walk.true + noise, walk)["speed"], 0.02, rtol=0.05)


def test_a_low_pass_makes_differences_late_by_its_time_constant() -> None:
    walk = walked()
    plain, smooth = (judge(differences(walk, how), walk) for how in (lambda values, dt: values, low_passed))
    np.testing.assert_allclose(plain["speed late"], 0.5, atol=0.1)
    np.testing.assert_allclose(smooth["speed late"], 7.0, atol=0.2)
    np.testing.assert_allclose(smooth["acceleration late"], 14.0, atol=0.5)


def test_frequencies_between_two_are_passed_whole() -> None:
    t = DT * np.arange(1000)[:, None]
    slow, fast = np.sin(2.0 * np.pi * 3.0 * t), np.sin(2.0 * np.pi * 40.0 * t)
    np.testing.assert_allclose(passed(slow + fast, DT, 0.0, JUDGED), slow, atol=1e-12)
