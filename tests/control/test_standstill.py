"""An axis is at rest when it has been slow for a while."""

from hapticd.control.standstill import Standstill

BOTH = (False, False)


def test_axes_are_at_rest_when_all_have_been_slow_for_long_enough() -> None:
    rest = Standstill((0.25, 0.05), 10)
    assert [rest.update((0.2, -0.04), BOTH) for _ in range(12)] == [False] * 9 + [True] * 3
    assert not rest.update((0.2, 0.06), BOTH)
    assert [rest.update((0.2, -0.04), BOTH) for _ in range(10)] == [False] * 9 + [True]


def test_an_axis_that_turns_round_is_not_at_rest() -> None:
    rest = Standstill((0.25,), 10)
    swing = [0.1 * abs(k % 40 - 20) - 1.0 for k in range(400)]
    assert not any(rest.update((v,), (False,)) for v in swing)


def test_an_axis_that_nobody_measures_does_not_count() -> None:
    rest = Standstill((0.25, 0.05), 3)
    assert [rest.update((9.0, 0.0), (True, False)) for _ in range(3)] == [False, False, True]
    rest.reset()
    assert not rest.update((0.0, 0.0), BOTH)


def test_what_is_no_number_is_no_rest() -> None:
    rest = Standstill((0.25,), 1)
    assert not rest.update((float("nan"),), (False,))
