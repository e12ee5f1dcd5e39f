"""A way of joints: inside its ratings, smooth, at rest at both ends."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.control.way import Way

DT = 1e-3


@pytest.mark.parametrize("seed", range(8))
def test_no_way_is_faster_or_sharper_than_rated_and_every_one_arrives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, 8))
    velocity, acceleration = rng.uniform(0.1, 3.0, m), rng.uniform(0.5, 20.0, m)
    way = Way(velocity, acceleration, DT)
    way.rest(rng.uniform(-2.0, 2.0, m))
    for target in rng.uniform(-2.0, 2.0, (2, m)):
        way.go(target)
        path = [way.q.copy()]
        while not way.arrived:
            way.advance()
            path.append(way.q.copy())
            assert (np.abs(way.qd) <= velocity * (1 + 1e-9)).all()
            assert (np.abs(way.qdd) <= acceleration * (1 + 1e-9)).all()
        np.testing.assert_allclose(way.q, target, atol=1e-12)
        assert not way.qd.any() and not way.qdd.any()
        # a joint is as fast, or as sharp, as it may be somewhere: nobody waits longer than needed
        speed, jolt = np.diff(path, axis=0) / DT, np.diff(path, 2, axis=0) / DT**2
        share = max((np.abs(speed) / velocity).max(), (np.abs(jolt) / acceleration).max())
        assert share > 0.95 or len(path) < 200


def test_speed_and_acceleration_are_derivatives_of_the_place() -> None:
    way = Way(np.array([1.0]), np.array([4.0]), DT)
    way.rest(np.array([0.3]))
    way.go(np.array([-0.9]))
    q, qd, qdd = [], [], []
    while not way.arrived:
        way.advance()
        q.append(way.q[0])
        qd.append(way.qd[0])
        qdd.append(way.qdd[0])
    np.testing.assert_allclose(np.gradient(q, DT)[1:-1], qd[1:-1], atol=1e-5)
    np.testing.assert_allclose(np.gradient(qd, DT)[1:-1], qdd[1:-1], atol=1e-4)


def test_a_way_to_where_one_is_takes_no_time() -> None:
    way = Way(np.ones(2), np.ones(2), DT)
    way.rest(np.array([0.1, 0.2]))
    way.go(np.array([0.1, 0.2]))
    assert way.arrived
