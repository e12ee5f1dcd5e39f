"""Late commands."""

from hapticd.sim.delay import Delay


def test_commands_come_so_many_ticks_late_and_nothing_is_late_that_switches_off() -> None:
    late, on = Delay(2, 2), [False, False]
    assert [list(late([k, -k], on)) for k in (1.0, 2.0, 3.0)] == [[0.0, 0.0], [0.0, 0.0], [1.0, -1.0]]
    assert late([4.0, -4.0], [True, False]) == [0.0, -2.0]
    assert late([5.0, -5.0], on) == [3.0, -3.0]


def test_without_a_delay_commands_pass() -> None:
    at_once = Delay(0, 2)
    assert at_once([1.0, 2.0], [False, False]) == [1.0, 2.0]
