"""What a person wants at given times: even in between, the ends held, as numpy has it."""

from __future__ import annotations

import numpy as np
from hapticd.machines.telemanipulation.plant import Script


def test_a_script_goes_evenly_from_one_time_to_the_next_and_holds_its_ends() -> None:
    random = np.random.default_rng(1)
    for count in (1, 2, 3, 8):
        times, rows = np.sort(random.uniform(0.0, 10.0, count)), random.normal(size=(count, 3))
        script = Script(times.tolist(), rows.tolist())
        for time in (*random.uniform(-1.0, 11.0, 30), *times):
            assert script.at(float(time)) == [np.interp(time, times, column) for column in rows.T]


def test_a_script_may_jump() -> None:
    script = Script([0.0, 1.0, 1.0, 2.0], [[0.0], [1.0], [5.0], [6.0]])
    assert [script.at(time) for time in (0.5, 1.0, 1.5)] == [[0.5], [5.0], [5.5]]
