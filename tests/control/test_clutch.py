"""A far palm goes the way of the near one, and does not notice what that does while the clutch is open."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.clutch import Clutch


def pose(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return rng.uniform(-1.0, 1.0, 3), pin.exp3(rng.uniform(-1.0, 1.0, 3))


def test_aligned_it_is_wanted_where_the_near_one_is() -> None:
    rng, clutch = np.random.default_rng(1), Clutch(1.0)
    clutch.align(*pose(rng))
    place, rotation = pose(rng)
    clutch.update(place, rotation, False)
    assert clutch.position == pytest.approx(place) and np.allclose(clutch.rotation, rotation)


@pytest.mark.parametrize("scale", [0.3, 1.0, 2.0])
def test_an_open_clutch_moves_nothing_and_a_closed_one_goes_on_without_a_jump(scale: float) -> None:
    rng, clutch = np.random.default_rng(2), Clutch(scale)
    clutch.align(*pose(rng))
    clutch.update(*pose(rng), False)
    left, turned = clutch.position.copy(), clutch.rotation.copy()
    for _ in range(3):
        clutch.update(*pose(rng), True)
        assert (clutch.position == left).all() and (clutch.rotation == turned).all()
    place, rotation = pose(rng)
    clutch.update(place, rotation, False)
    assert np.allclose(clutch.position, left) and np.allclose(clutch.rotation, turned)
    way, turn = rng.uniform(-0.1, 0.1, 3), pin.exp3(rng.uniform(-0.5, 0.5, 3))
    clutch.update(place + way, turn @ rotation, False)
    assert np.allclose(clutch.position, left + scale * way)
    assert np.allclose(clutch.rotation, turn @ turned), "turns are not scaled"
    assert np.allclose(clutch.rotation @ clutch.rotation.T, np.eye(3))
