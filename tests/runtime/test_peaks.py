"""Motors that may give more than their rated torque for a time do so for that time, and no longer."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.errors import ConfigError
from hapticd.safety.heat import ADMITTED, PLANNED
from hapticd.testing import bench as benches
from hapticd.testing.copies import in_a_copy
from hapticd.testing.push import push

from .conftest import after, changed

RATED = 130.0
MODEL = read_text("giant.urdf").replace('effort="260.0"', f'effort="{RATED:g}"')
DRIVE = 'rated_torque = "260 N m"'
PEAK = 'rated_torque = "130 N m"\npeak_torque = "195 N m"\npeak_time = "0.5 s"'


def loaded(*changes: tuple[str, str], model: str = MODEL, machine: str = "giant") -> config.Loaded:
    text, source = changed(*changes, machine=machine), f"{machine}.toml"
    return config.Loaded(machine, config.parse(text, source), text, source, model, f"{machine}.urdf")


def weak(_: str) -> benches.Bench:
    """A giant whose first two motors have half of their torque, and half as much more for half a second."""
    return benches.Bench(loaded((DRIVE, PEAK), (DRIVE, PEAK)))


def pulled(used: float) -> benches.Bench:
    """It renders, and a hand begins to pull with 100 N; once the first motor has its hands full, all accounts
    of it say so much."""
    bench = benches.parked(weak, "giant", after(Mode.ACTIVE, 5))
    machine, cycle = bench.cycle.machine, bench.cycle
    assert cycle.gate._heat is not None
    (heat,) = machine.plausibility._heats
    begin = bench.tick_index

    def pull(hold, *_):  # type: ignore[no-untyped-def]
        strength = 100.0 * min(1.0, (bench.tick_index - begin + 1) / 200)
        push(hold, np.array([0.0, strength, 0.0, 0.0, 0.0, 0.0]))

    bench.plant.hand.aim = pull
    while abs(bench.torques[0]) < 0.95 * RATED:
        bench.run(1)
    heat.used[0] = cycle.gate._heat.used[0] = bench.joints[0].used = used
    return bench


def watch(bench: benches.Bench, ticks: int) -> tuple[list[float], float]:
    """Torques of the first motor in some ticks, and the largest share that its drive counted."""
    torques, used = [], 0.0
    for _ in range(ticks):
        bench.run(1)
        torques.append(abs(bench.torques[0]))
        used = max(used, bench.joints[0].used)
        assert not any(drive.folded for drive in bench.joints)
    return torques, used


@in_a_copy
def test_a_motor_gives_its_peak_while_a_hand_asks_for_it() -> None:
    bench = pulled(0.0)
    torques, used = watch(bench, 400)
    assert bench.mode is Mode.ACTIVE
    assert 1.3 * RATED < max(torques) <= 1.5 * RATED
    assert 0.1 < used < PLANNED
    assert bench.cycle.gate.clamps == 0


@in_a_copy
def test_a_motor_whose_time_is_nearly_used_up_comes_down_to_its_rated_torque_without_being_clamped() -> None:
    bench = pulled(0.78)
    torques, used = watch(bench, 400)
    assert bench.mode is Mode.ACTIVE
    assert 0.98 * RATED < max(torques) < 1.15 * RATED
    assert 0.77 < used < PLANNED + 0.01
    assert bench.cycle.gate.clamps == 0


@in_a_copy
def test_a_controller_that_keeps_no_account_is_stopped_by_the_gate_before_its_drive_folds_back() -> None:
    bench = pulled(0.93)
    bench.cycle.machine.plausibility._heats.clear()
    watch(bench, 400)
    assert bench.reason == "output_beyond_limit"
    assert bench.joints[0].used < 1.0


@in_a_copy
def test_a_daemon_that_keeps_none_at_all_is_seen_by_what_its_drive_no_longer_gives() -> None:
    bench = pulled(0.98)
    bench.cycle.machine.plausibility._heats.clear()
    bench.cycle.gate._heat = None
    bench.cycle.gate._most[:] = 195.0
    folded = False
    for _ in range(400):
        bench.run(1)
        folded |= bench.joints[0].folded
    assert folded
    assert bench.mode in (Mode.STOPPED, Mode.STOPPING)
    assert bench.reason in ("torque_mismatch", "device_fault", "not_following")


@in_a_copy
def test_people_read_how_much_of_the_peak_is_left() -> None:
    bench = pulled(0.0)
    figures = bench.lockstep.session.system.figures(bench.lockstep.session.config)
    record = np.zeros(1, bench.cycle.machine.state)
    bench.cycle.machine.bind_state(record)

    def words() -> str:
        bench.cycle.machine.fill()
        return " ".join(figures.live(Mode.ACTIVE, record[0]))

    watch(bench, 40)
    assert "joint 1 at its peak torque" in words()
    record["heat"], record["spent"] = PLANNED, 1
    assert "joint 1 at its rated torque" in " ".join(figures.live(Mode.ACTIVE, record[0]))
    assert PLANNED < ADMITTED < 1.0


HOSTILE = [
    ('"195 N m"', '"130 N m"', "peak_torque", "beside a rated torque"),
    ('"195 N m"', '"1 N m"', "peak_torque", "beside a rated torque"),
    ('"195 N m"', '"9999 N m"', "peak_torque", "out of range"),
    ('"195 N m"', '"-195 N m"', "peak_torque", "out of range"),
    ('"195 N m"', '"nan N m"', "peak_torque", "NaN"),
    ('"195 N m"', '"inf N m"', "peak_torque", ""),
    ('"195 N m"', '"195 N"', "peak_torque", "not a unit of torque"),
    ('"0.5 s"', '"1 ms"', "peak_time", "out of range"),
    ('"0.5 s"', '"1 h"', "peak_time", "not a unit of time"),
    ('"0.5 s"', '"2 min"', "peak_time", "out of range"),
    ('peak_time = "0.5 s"', "", "peak_time", "is missing"),
    ('peak_torque = "195 N m"', "", "peak_torque", "is missing"),
    ('rated_torque = "130 N m"', 'rated_torque = "120 N m"', "peak_torque", "effort 130 is above"),
]


@pytest.mark.parametrize(("old", "new", "key", "problem"), HOSTILE)
def test_a_peak_that_is_none_is_refused_with_its_key(old: str, new: str, key: str, problem: str) -> None:
    assert old in PEAK
    with pytest.raises(ConfigError) as error:
        build(loaded((DRIVE, PEAK.replace(old, new))))
    assert [found.key for found in error.value.findings] == [f"devices.joint_1.{key}"]
    assert problem in error.value.findings[0].problem


@pytest.mark.parametrize(
    ("machine", "old", "changes"),
    [
        ("rhi", "0.1", ()),
        ("operator", "3", ()),
        ("giant", "260", (('detection = "gauss"', 'detection = "redetect"'),)),
    ],
)
def test_a_peak_that_a_controller_has_no_use_for_is_refused(
    machine: str, old: str, changes: tuple[tuple[str, str], ...]
) -> None:
    drive = f'rated_torque = "{old} N m"'
    peak = f'{drive}\npeak_torque = "{2 * float(old):g} N m"\npeak_time = "2 s"'
    with pytest.raises(ConfigError) as error:
        model = read_text("bimanual.urdf" if machine == "operator" else f"{machine}.urdf")
        build(loaded((drive, peak), *changes, model=model, machine=machine))
    assert [found.key.rpartition(".")[2] for found in error.value.findings] == ["peak_torque"]
