"""A twin that lacks directions follows the handle in them, and nowhere else."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.twin import CartesianTwin


def twin(directions: list[int]) -> CartesianTwin:
    made = CartesianTwin(2.0, 0.05, 4.0, 0.2, (3.0, 8.0), (60.0, 200.0), directions)
    made.reset(np.array([0.1, 0.2, 0.3]), pin.exp3(np.array([0.3, -0.2, 0.5])))
    return made


@pytest.mark.parametrize("directions", [[0, 1, 2], [0, 1, 5], [0, 1, 2, 3, 5], [2, 4]])
def test_what_it_lacks_is_the_handles(directions: list[int]) -> None:
    made = twin(directions)
    place = np.array([0.4, -0.1, 0.2])
    rotation = pin.exp3(np.array([0.2, 0.3, -0.1])) @ made.rotation
    before = np.concatenate([made.position - place, pin.log3(made.rotation @ rotation.T)])
    made.follow(place, rotation)
    error = np.concatenate([made.position - place, pin.log3(made.rotation @ rotation.T)])
    lacking = [i for i in range(6) if i not in directions]
    np.testing.assert_allclose(error[lacking], 0.0, atol=1e-9)
    np.testing.assert_allclose(error[directions], before[directions], atol=1e-9)


def test_a_twin_with_all_directions_follows_nothing() -> None:
    made = twin(list(range(6)))
    before = made.position.copy(), made.rotation.copy()
    made.follow(np.ones(3), np.eye(3))
    assert (made.position == before[0]).all() and (made.rotation == before[1]).all()


@pytest.mark.parametrize("directions", [[0, 1, 2], [2, 4], list(range(6))])
def test_it_moves_as_a_free_body_does_in_its_directions(directions: list[int]) -> None:
    made, rng, dt = twin(directions), np.random.default_rng(1), 1e-3
    for _ in range(20):
        wrench, qdd = rng.standard_normal(6), rng.standard_normal(len(directions))
        position, rotation, v = made.position.copy(), made.rotation.copy(), made.twist.copy()
        made.update(wrench)
        damping = np.array([4.0] * 3 + [0.2] * 3)[directions]
        assert (made.force == wrench[directions] - damping * v[directions]).all()
        made.integrate(qdd, dt)
        a = np.zeros(6)
        a[directions] = qdd
        way = v * dt + 0.5 * a * dt * dt
        assert made.position == pytest.approx(position + way[:3], abs=1e-15)
        assert made.rotation == pytest.approx(pin.exp3(way[3:]) @ rotation, abs=1e-14)
        assert made.twist == pytest.approx(v + a * dt, abs=1e-15)
        assert (made.qd == made.twist[directions]).all()
