"""What a seed draws for both stations."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.experiments.strange_pair import BEGIN_S, ROOM, TURN, strange_case

FIRST = np.array([[0.45, 0.25, 1.0], [0.45, -0.25, 1.0]])


@pytest.mark.parametrize("seed", range(40))
def test_a_case_is_one_that_a_person_could_be_in(seed: int) -> None:
    case = strange_case(seed, 20.0)
    times = np.array(case.times)
    assert (np.diff(times) > 0.0).all() and times[-1] >= 20.0
    assert not case.places[times <= BEGIN_S].any()
    bounds = np.tile([ROOM] * 3 + [TURN] * 3, 2)
    assert (np.abs(case.places) <= bounds).all()
    for wall in case.walls:
        assert all(wall.depth(palm) < 0.0 for palm in FIRST), "no palm begins in a wall"
        assert 1e3 <= wall.stiffness <= 1e4
    assert case.network.longest < 0.5


def test_the_same_seed_draws_the_same_case_and_another_another() -> None:
    first, again, other = (strange_case(seed, 15.0) for seed in (3, 3, 4))
    assert (first.times, first.network) == (again.times, again.network)
    assert (first.places == again.places).all()
    assert first.times != other.times
