"""Springs, rotors and friction identified from joints of known truth, and from a recorded session."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.experiments.identification import Identified, Recorded, identify
from hapticd.experiments.identify import WRITTEN
from hapticd.runtime.command_line.cli import main

from ..machines.giant.own_tables import OWN

DT = 1e-3
TORQUE, TOP_SPEED = 260.0, 2.5
TRUTH = {
    "stiffness": 12000.0,
    "rotor_inertia": 1.9,
    "coulomb": 5.0,
    "load_friction": 0.06,
    "viscous": 3.0,
}
SECONDS = 12.0


def joint(
    seed: int, late: int = 2, load: float = 120.0, speed: float = 1.2, quick: float = 3.0, way: float = 1.0
) -> Recorded:
    """A joint that is led to and fro under a load that changes; noise, and offsets of its sensors.

    Args:
        seed: of the noise.
        late: ticks from a command to what is measured of it.
        load: its amplitude [N m]; speed: of the motor, amplitude [rad/s]; quick: its frequency [rad/s].
        way: of the motion: 1 to and fro, 0 to.
    """
    random, t = np.random.default_rng(seed), DT * np.arange(round(SECONDS / DT))
    middle = t + 0.5 * DT  # a command holds from one tick to the next
    turn = lambda s: speed * (np.sin(quick * s) + 0.3 * np.sin(2.7 * quick * s) + 1.5 * (1 - way))  # noqa: E731
    faster = lambda s: speed * quick * (np.cos(quick * s) + 0.81 * np.cos(2.7 * quick * s))  # noqa: E731
    pull = lambda s: load * np.sin(1.1 * s + seed)  # noqa: E731
    sign = np.sign(turn(middle))
    rub = (TRUTH["coulomb"] + TRUTH["load_friction"] * np.abs(pull(middle))) * sign
    told = pull(middle) + rub + TRUTH["viscous"] * turn(middle) + TRUTH["rotor_inertia"] * faster(middle)
    told = np.concatenate([told[late - 1 :], np.zeros(late - 1)])  # told so much earlier
    noise = random.standard_normal((3, len(t)))
    measured = pull(t) + 0.4 + 0.1 * noise[0]
    deflection = pull(t) / TRUTH["stiffness"] + 2e-4 + 1e-5 * noise[1]
    kept = len(t) - MARGIN
    return Recorded(told[:kept], measured[:kept], (turn(t) + 2e-3 * noise[2])[:kept], deflection[:kept])


MARGIN = 10
"""Ticks at the end that are told nothing any more."""


def of(*runs: Recorded) -> Identified:
    return identify(runs, TORQUE, TOP_SPEED, DT)


@pytest.mark.parametrize("late", [1, 2, 4])
def test_what_is_identified_is_the_truth_within_its_standard_errors(late: int) -> None:
    off = []
    for seed in range(8):
        found = of(joint(seed, late))
        assert not found.refused
        assert found.late == late
        assert set(found.found) == set(TRUTH)
        off += [(found.found[name].value - truth) / found.found[name].error for name, truth in TRUTH.items()]
        for name, truth in TRUTH.items():
            assert found.found[name].value == pytest.approx(truth, rel=0.05), name
    assert np.sqrt(np.mean(np.square(off))) < 3.0  # what is left of a window is like its neighbours'


def test_noise_makes_errors_larger_and_residuals_tell_it() -> None:
    calm = joint(1)
    load = calm.load + np.random.default_rng(5).normal(0, 3.0, len(calm.load))
    loud = Recorded(calm.told, load, calm.speed, calm.deflection)
    before, after = of(calm), of(loud)
    assert after.found["stiffness"].error > 3.0 * before.found["stiffness"].error
    assert after.residual["spring"] > 3.0 * before.residual["spring"]
    assert after.residual["spring"] == pytest.approx(3.0 / np.sqrt(10.0), rel=0.2)  # means of ten


REFUSED = {
    "too light": (dict(load=3.0), "stiffness"),
    "too slow": (dict(quick=0.3, speed=0.3), "rotor_inertia"),
    "at rest": (dict(speed=0.0), "rotor_inertia"),
    "in one direction": (dict(way=0.0, speed=0.7), "coulomb"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_was_not_excited_is_refused_and_says_why(name: str) -> None:
    changes, missing = REFUSED[name]
    found = of(joint(1, **changes))  # type: ignore[arg-type]
    assert missing not in found.found
    assert any(missing in reason or "rotor and friction" in reason for reason in found.refused)


def test_a_torque_sensor_of_another_gain_does_not_move_the_inertia_of_a_rotor() -> None:
    """Most of a joint's load may be inertia behind its spring: a share of it would pass for the rotor's."""
    true = joint(3)
    faster = np.gradient(true.speed, DT)
    heavy = 20.0 * np.convolve(faster, np.ones(40) / 40, "same")
    late = np.concatenate([heavy[1:], heavy[-1:]])  # told two ticks before it is measured, held for one
    told, load = true.told + late, 0.96 * (true.load + heavy)
    found = of(Recorded(told, load, true.speed, (true.load + heavy) / TRUTH["stiffness"])).found
    assert found["rotor_inertia"].value == pytest.approx(TRUTH["rotor_inertia"], rel=0.1)


def test_friction_that_noise_hides_is_refused_rather_than_fed_forward() -> None:
    calm = joint(1)
    speed = calm.speed + np.random.default_rng(6).normal(0.0, 0.5, len(calm.speed))
    load = calm.load + np.random.default_rng(5).normal(0.0, 400.0, len(calm.load))
    found = of(Recorded(calm.told, load, speed, calm.deflection))
    assert not {"coulomb", "viscous", "load_friction"} & set(found.found)
    assert any(reason.startswith("coulomb") or "moved" in reason for reason in found.refused)


def test_runs_with_a_gap_between_are_not_joined() -> None:
    whole = joint(2)
    parts = [
        Recorded(*(getattr(whole, key)[a:b] for key in ("told", "load", "speed", "deflection")))
        for a, b in ((0, 5000), (7000, 11000))
    ]
    found = of(*parts)
    assert not found.refused
    assert found.found["rotor_inertia"].value == pytest.approx(TRUTH["rotor_inertia"], rel=0.02)


def test_too_short_a_recording_identifies_nothing() -> None:
    whole = joint(2)
    found = of(Recorded(*(getattr(whole, key)[:500] for key in ("told", "load", "speed", "deflection"))))
    assert not found.found
    assert len(found.refused) == 2


def test_a_recorded_walk_tells_the_springs_of_the_machine_that_walked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], write_walk: Path
) -> None:
    out = tmp_path / "identified.toml"
    capsys.readouterr()
    status = main(["identify", str(write_walk), "--json", "--out", str(out)])
    said = json.loads(capsys.readouterr().out)["joints"]
    assert status == 1  # a short walk does not load every spring
    turning = said["joint_1"]
    fed = {"gear_friction": 5.2, "load_friction": 0.05, "bearing_friction": 0.8}
    assert turning["believed"] == {"stiffness": 15000.0, "rotor_inertia": 1.5, **fed}
    assert turning["identified"]["stiffness"]["value"] == pytest.approx(10500.0, rel=0.03)
    assert turning["late"] == 2
    assert any(joint["refused"] for joint in said.values())
    written = tomllib.loads(out.read_text())["giant"]["tracking"]
    assert float(written["stiffness"].split()[0]) == pytest.approx(10500.0, rel=0.03)
    assert float(written["stiffness"].split()[5]) == 2500.0  # as it was believed
    assert set(written) == set(WRITTEN)
    pasted = tmp_path / "pasted.toml"
    table = "\n".join(line for line in out.read_text().splitlines() if line.startswith(tuple(WRITTEN)))
    old = rf"(?m)^({'|'.join(WRITTEN)}) = .*\n"
    before, rest = read_text("giant.toml").split("[giant.tracking]\n")
    pasted.write_text(f"{before}[giant.tracking]\n{table}\n{re.sub(old, '', rest, count=5)}")
    assert main(["check", str(pasted)]) == 0
    assert main(["identify", str(write_walk), "--out", str(out)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert main(["identify", str(write_walk)]) == 1
    table = capsys.readouterr().out
    assert "believed 15000: -" in table
    assert "not identified: " in table


@pytest.fixture
def write_walk(tmp_path: Path) -> Path:
    """A recording of eight seconds of the giant, whose springs are softer than its controller believes."""
    text = read_text("giant.toml").replace(OWN, "[simulation.plant]\nstiffness = 0.7\n\n")
    (tmp_path / "giant.urdf").write_text(read_text("giant.urdf"))
    machine, log = tmp_path / "machine.toml", tmp_path / "walk.mcap"
    machine.write_text(text)
    assert main(["run", str(machine), "--lockstep", "--duration", "8", "--log", str(log)]) == 0
    return log
