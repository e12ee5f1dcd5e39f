"""Late commands."""

import numpy as np
from hapticd.sim.delay import Delay


def test_commands_come_so_many_ticks_late_and_nothing_is_late_that_switches_off() -> None:
    late, on, command = Delay(2, 2), np.zeros(2, np.bool_), np.zeros(2)

    def told(k: float, off: np.ndarray = on) -> list[float]:
        command[:] = k, -k  # one buffer, as drives have it
        return late(command, off).tolist()

    assert [told(k) for k in (1.0, 2.0, 3.0)] == [[0.0, 0.0], [0.0, 0.0], [1.0, -1.0]]
    assert told(4.0, np.array([True, False])) == [0.0, -2.0]
    assert told(5.0) == [3.0, -3.0]


def test_without_a_delay_commands_pass() -> None:
    at_once = Delay(0, 2)
    assert at_once(np.array([1.0, 2.0]), np.zeros(2, np.bool_)).tolist() == [1.0, 2.0]
