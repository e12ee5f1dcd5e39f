"""A twin's stops are met as the machine can stop its handle, however light the twin and fast the hand."""

from pathlib import Path

import numpy as np
from hapticd.configs import read_text
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.testing.bench import Bench
from hapticd.testing.copies import in_a_copy

FLICKS = """
[hand]
path = [{ at = "0 s" }, { at = "3.5 s" },
        { at = "3.55 s", handle = "0.9 rad" }, { at = "3.8 s", handle = "0.9 rad" },
        { at = "3.85 s", handle = "-0.3 rad" }, { at = "4.2 s", handle = "-0.3 rad" }]
"""


@in_a_copy
def test_a_hand_that_flicks_the_doors_handle_from_stop_to_stop(tmp_path: Path) -> None:
    """0.06 kg m^2 that is rated for 100 rad/s^2: joints 1 and 2 can stop a third of that."""
    door = read_text("twins/door.toml")
    (tmp_path / "door.toml").write_text(door[: door.index("[touches]")] + FLICKS)
    bench = Bench(config.load(f"giant with {tmp_path / 'door.toml'}"))
    control, machine = bench.cycle.machine.force_control, bench.cycle.machine  # type: ignore[attr-defined]
    bench.until(Mode.ACTIVE, limit=4000)
    apart, step, fastest, last = np.zeros(2), 0.0, 0.0, np.array(machine.commands)
    place = []
    while bench.plant.time < 4.2:
        bench.run(1)
        error, told = control.coupling_error, np.array(machine.commands)
        apart = np.maximum(apart, [np.linalg.norm(error[:3]), np.linalg.norm(error[3:])])
        step, last = max(step, float(np.abs(told - last).max())), told
        fastest = max(fastest, abs(control.twin.qd[1]))
        place.append(control.twin.q[1])
    assert bench.mode is Mode.ACTIVE
    assert fastest > 3.0
    low, high = control.twin.limits.lower[1], control.twin.limits.upper[1]
    assert high - 1e-3 < max(place) <= high + 1e-6  # both stops are met
    assert low - 1e-6 <= min(place[250:]) < low + 1e-3
    assert apart[0] < 2e-3 and apart[1] < 2e-3  # the handle stays on the twin
    assert step < 220.0
