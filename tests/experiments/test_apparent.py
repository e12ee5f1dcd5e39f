"""Inertia and friction of a handle, from pushes of known truth, and of the built-in redundant interface."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hapticd.experiments import identify_handle
from hapticd.experiments.apparent import Apparent, Push, UnexcitedError, apparent
from hapticd.experiments.own_plant import Doubt
from hapticd.experiments.palpation import Device
from hapticd.experiments.rhi_table1 import PAPER, direct_inertia
from hapticd.experiments.zero_phase import zero_phase
from hapticd.models import Array
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.config import load

RATE, FINER = 1000.0, 20
INERTIA, CHANGE, FRICTION, OFFSET = 0.12, 0.8, 0.6, 0.15
"""At the point, of the inertia along the line, viscous, and what the force sensor reads without force."""
FORCES = np.linspace(0.5, 2.0, 10)


def push(force: float, noise: np.random.Generator, offset: float = OFFSET, spring: float = 0.0) -> Push:
    """A mass that changes along its way, pushed from 5 cm before the point, to either side."""
    way = np.sign(force)
    x, v, along = -0.05 * way, 0.0, []
    while x * way < 0.02:
        along.append(x)
        for _ in range(FINER):
            inertia = INERTIA + CHANGE * x
            v += (force - FRICTION * v - spring * x - 0.5 * CHANGE * v * v) / inertia / RATE / FINER
            x += v / RATE / FINER
    k = len(along)
    seen = force + offset + 0.02 * noise.standard_normal(k)
    return Push(np.round(np.array(along) / 1e-6) * 1e-6, np.zeros((k, 2)), seen)


def identify(forces: Array, offset: float = OFFSET, spring: float = 0.0) -> Apparent:
    noise = np.random.default_rng(4)
    return apparent([push(force, noise, offset, spring) for force in forces.tolist()], 0.0, RATE)


def test_pushes_both_ways_tell_inertia_its_change_and_friction_beside_an_offset() -> None:
    found = identify(np.concatenate([FORCES, -FORCES]))
    assert found.inertia.value == pytest.approx(INERTIA, rel=0.03)
    assert found.friction.value == pytest.approx(FRICTION, rel=0.03)
    assert found.change.value == pytest.approx(CHANGE, rel=0.1)
    for estimate, truth in ((found.inertia, INERTIA), (found.friction, FRICTION), (found.change, CHANGE)):
        assert abs(estimate.value - truth) < 4.0 * estimate.error


def coupled(aside: float, rubs: Array, stiffness: float) -> list[Push]:
    """Two axes whose inertias and frictions are coupled; the guide across is soft."""
    mass, pushes = np.array([[1.8, -aside], [-aside, 3.0 * aside]]), []
    for force in np.concatenate([4.0 * FORCES, -4.0 * FORCES]).tolist():
        way, q, v = np.sign(force), np.array([-0.05 * np.sign(force), 0.0]), np.zeros(2)
        places = []
        while q[0] * way < 0.02 and len(places) < 3000:
            places.append(q.copy())
            for _ in range(FINER):
                pull = np.array([force, -stiffness * q[1] - 60.0 * v[1]])
                v = v + np.linalg.solve(mass, pull - rubs @ v) / RATE / FINER
                q = q + v / RATE / FINER
        rows = np.array(places)
        across = np.column_stack([rows[:, 1], np.zeros(len(rows))])
        pushes.append(Push(rows[:, 0], across, np.full(len(rows), force)))
    return pushes


RUBS = np.array([[2.5, -1.0], [-1.0, 4.0]])


def test_a_handle_that_yields_across_the_line_is_not_taken_for_a_lighter_one() -> None:
    pushes = coupled(0.7, RUBS, 1500.0)
    found = apparent(pushes, 0.0, RATE)
    assert found.inertia.value == pytest.approx(1.8, rel=0.03)
    assert found.friction.value == pytest.approx(2.5, rel=0.08)
    straight = [Push(each.along, 0.0 * each.across, each.force) for each in pushes]
    blind = apparent(straight, 0.0, RATE)
    assert abs(blind.inertia.value - 1.8) > 3.0 * abs(found.inertia.value - 1.8)


def test_a_handle_that_yields_as_it_moves_is_refused() -> None:
    with pytest.raises(UnexcitedError, match="what it does across the line"):
        apparent(coupled(2.4, RUBS, 400.0), 0.0, RATE)


def test_pushes_one_way_tell_them_where_nothing_is_offset() -> None:
    found = identify(FORCES, offset=0.0)
    assert found.inertia.value == pytest.approx(INERTIA, rel=0.05)
    assert found.friction.value == pytest.approx(FRICTION, rel=0.05)


def test_a_handle_that_a_spring_pushes_is_refused() -> None:
    with pytest.raises(UnexcitedError, match="something else pushes"):
        identify(np.concatenate([FORCES, -FORCES]), spring=300.0)


def test_pushes_that_end_before_the_point_are_refused() -> None:
    noise = np.random.default_rng(1)
    short = [
        Push(each.along[:5], each.across[:5], each.force[:5]) for each in (push(1.0, noise), push(2.0, noise))
    ]
    with pytest.raises(UnexcitedError, match="0 samples within 10 mm of the point"):
        apparent(short, 0.0, RATE)


def test_a_steady_speed_tells_no_inertia() -> None:
    along = np.arange(-0.05, 0.02, 1e-4)
    force = FRICTION * 0.1 + 0.02 * np.random.default_rng(2).standard_normal(len(along))
    with pytest.raises(UnexcitedError, match=r"condition number|too uncertain"):
        across = np.zeros((len(along), 2))
        apparent([Push(along, across, force), Push(-along, across, -force)], 0.0, RATE)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_filter_is_linear_and_passes_what_is_slow(mirrored: bool) -> None:
    t = np.arange(400) / RATE
    slow, fast = np.cos(2 * np.pi * 5.0 * t), np.cos(2 * np.pi * 300.0 * t)
    smooth = zero_phase(slow + fast, 80.0, RATE, mirrored=mirrored)
    parts = [zero_phase(part, 80.0, RATE, mirrored=mirrored) for part in (slow, fast)]
    assert smooth == pytest.approx(parts[0] + parts[1], abs=1e-12)
    middle = slice(50, -50)
    assert smooth[middle] == pytest.approx(slow[middle], abs=0.02)


def test_the_built_in_interface_feels_as_its_model_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "rhi.svg"
    assert main(["identify", "rhi", "--along", "y", "--json", "--plot", str(picture)]) == 0
    rows = json.loads(capsys.readouterr().out)["handle"]
    assert [(row["state"], row["along"]) for row in rows] == [("free", "y"), ("stiff", "y")]
    device = Device()
    for row in rows:
        device.centre = np.array(row["at"][:2])
        inertia, friction = row["inertia"]["value"], row["friction"]["value"]
        assert inertia == pytest.approx(direct_inertia(device, row["state"] == "stiff"), rel=0.08)
        assert friction == pytest.approx(PAPER[row["state"]][1], rel=0.08)
        assert row["condition"] < 20.0 and row["samples"] > 200 and row["refused"] is None
    assert "<svg" in picture.read_text(encoding="utf-8")


def test_a_place_that_the_handle_does_not_reach_is_refused_with_its_state(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["identify", "rhi", "--along", "y", "--at", "0.95", "0", "0"]) == 1
    written = " ".join(capsys.readouterr().out.split())
    assert written.count("not identified: the handle cannot be led to where the line begins: ") == 2
    assert "stiff, along y through 0.95 0 0 m" in written


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["rhi", "--along", "z"], "--along z: the handle of this machine moves along x, y"),
        (["rhi", "--along", "up"], "'up' is no direction of the base"),
        (["rhi", "--at", "0", "0", "nan"], "'nan' is not a number of metres"),
        (["rhi", "--out", "new.toml"], "--out: what a hand feels of a handle"),
        (["rhi", "--wrong-model"], "--wrong-model: this kind of machine"),
        (["operator"], "the machine has 2 handles"),
        (["panda", "--along", "z"], "--along and --at are of --handle"),
        (["walk.mcap", "--handle"], "--handle needs a machine, not a recording"),
        (["walk.mcap", "--errors"], "--errors needs a machine, not a recording"),
        (["walk.mcap", "--wrong-model"], "--wrong-model needs a machine, not a recording"),
    ],
)
def test_what_does_not_fit_is_said_before_anything_is_pushed(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        status: object = main(["identify", *words])
    except SystemExit as ended:  # argparse
        status = ended.code
    assert status == 2
    assert said in " ".join(capsys.readouterr().err.split())


def test_a_hand_that_is_too_weak_is_told_of() -> None:
    loaded = load("rhi")
    hand = msgspec.structs.replace(loaded.config.simulation.hand, force=0.02)  # type: ignore[union-attr]
    simulation = msgspec.structs.replace(loaded.config.simulation, hand=hand)  # type: ignore[type-var]
    weak = replace(loaded, config=msgspec.structs.replace(loaded.config, simulation=simulation))
    told = identify_handle.push(weak, ["y"], None, Doubt(), 1)
    assert all(each.seen is None and each.refused for each in told)
