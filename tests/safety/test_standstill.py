"""What should stand is watched from the moment it stands."""

from math import nan

import pytest
from hapticd.safety.standstill import PATIENCE, Standstill, strayed

PLAY = (0.1, 0.01)


def watched(*positions: tuple[float, float], at_rest: bool = True, settling: int = 0) -> list[int]:
    standstill = Standstill(PLAY, settling)
    standstill.start()
    return [standstill.moved(position, at_rest) for position in positions]


def test_an_axis_within_its_play_stands() -> None:
    assert set(watched((1.0, 2.0), (1.09, 2.0), (0.91, 1.991), (1.0, 2.009))) == {-1}


def test_an_axis_beyond_its_play_has_moved_but_not_by_one_bad_sample() -> None:
    away = (1.0, 2.02)
    assert set(watched((1.0, 2.0), *[away] * (PATIENCE - 1), (1.0, 2.0), *[away] * (PATIENCE - 1))) == {-1}
    assert watched((1.0, 2.0), *[away] * (PATIENCE + 1)) == [-1] * PATIENCE + [1, 1]


def test_a_position_that_is_no_number_has_moved() -> None:
    assert watched((1.0, 2.0), *[(nan, 2.0)] * PATIENCE)[-1] == 0
    assert strayed((nan, 0.0), (0.0, 0.0), PLAY) == 0


@pytest.mark.parametrize(("at_rest", "first"), [(True, PATIENCE), (False, 10)])
def test_the_place_is_where_the_axes_come_to_rest_or_where_they_are_when_they_must(
    at_rest: bool, first: int
) -> None:
    moving = [(0.2 * k, 0.0) for k in range(20)]
    found = watched(*moving, at_rest=at_rest, settling=10)
    assert found.index(0) == first + PATIENCE


def test_rest_must_last() -> None:
    standstill = Standstill(PLAY, 100)
    standstill.start()
    for k in range(99):  # every third tick it moves
        assert standstill.moved((0.2 * k, 0.0), k % PATIENCE != 0) == -1


def test_a_new_start_forgets_the_place() -> None:
    standstill = Standstill(PLAY, 0)
    for place in (0.0, 5.0):
        standstill.start()
        assert [standstill.moved((place, 0.0), True) for _ in range(5)] == [-1] * 5
