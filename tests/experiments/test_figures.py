"""Plots that can be read: every axis and colour bar has its label, and colour alone tells nothing apart."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hapticd.bench import growth, jitter
from hapticd.experiments import (
    bimanual_fig6,
    bimanual_fig7,
    bimanual_link,
    bimanual_table1,
    bimanual_table2,
    bimanual_touch,
    collisions,
    giant_collisions,
    giant_estimation,
    giant_felt,
    giant_fig5,
    giant_fig6,
    giant_fig8,
    giant_fig9,
    giant_forces,
    giant_friction,
    giant_operator,
    giant_rest,
    giant_rules,
    giant_stops,
    giant_table1,
    giant_table3,
    giant_timing,
    giant_tracking,
    haptify,
    mounting,
    palpation,
    rhi_concept,
    rhi_fig9,
    rhi_fig10,
    rhi_fig11,
    rhi_hands,
    rhi_redundancy,
    rhi_table1,
    rhi_taps,
)
from hapticd.experiments.apparent import Apparent
from hapticd.experiments.command import NAMES
from hapticd.experiments.felt import Felt, lines
from hapticd.experiments.hands import Session
from hapticd.experiments.least_squares import Estimate
from hapticd.experiments.outcome import Outcome, write_plot
from hapticd.experiments.peg_trial import Trial

from .figures import faults

pytest.importorskip("matplotlib")

TOLD = Apparent(*[Estimate(value, 0.1) for value in (1.0, 2.0, 0.0)], 0.0, 1.0, np.zeros((4, 1)))


@pytest.fixture
def little_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """The experiments' plots do not depend on how long and how often something is simulated."""
    palpate = palpation.Device.palpate

    def briefly(self: palpation.Device, depth: float, hz: float, _: float, mode: str = "switching") -> Any:
        return palpate(self, depth, hz, 0.02, mode)

    class Bound:
        _force = np.array([12.0])

        def __init__(self, device: palpation.Device) -> None: ...

        def of(self, trace: palpation.Trace) -> float:
            return 12.0

    monkeypatch.setattr(palpation.Device, "palpate", briefly)
    for name, value in {
        "DEPTHS": (0.02,),
        "FREQUENCIES": (0.5,),
        "STEEPNESS": (1.0,),
        "VARIANTS": {"full": {}},
    }.items():
        monkeypatch.setattr(rhi_fig9, name, value)
    monkeypatch.setattr(rhi_fig9, "Bound", Bound)
    for name, count in {"GRID": 5, "STARTS": 4, "BEST": 2}.items():
        monkeypatch.setattr(rhi_fig10, name, count)
    monkeypatch.setattr(rhi_fig11, "switched", lambda rho, paper: palpation.Device().palpate(0.02, 0.5, 0.02))
    monkeypatch.setattr(rhi_fig11, "SWITCH", 10)
    for name, few in {"SCAN": 100, "REACH": 30, "TAPS": 3, "PERIODS": (0.3,), "WAIT": 0.1}.items():
        monkeypatch.setattr(rhi_taps, name, few)
    monkeypatch.setattr(rhi_taps, "TIMES", tuple(0.1 * t for t in rhi_taps.TIMES))
    monkeypatch.setattr(rhi_redundancy, "DIRECTIONS", 2)
    monkeypatch.setattr(rhi_redundancy, "SCAN", 300)
    monkeypatch.setattr(rhi_concept, "SCAN", 300)

    def handled(_: Any, seed: int) -> rhi_hands.Handled:
        excess = {"motor 1": -0.01 * (seed % 7), "motor 1 torque": 0.0}
        steps = np.arange(len(rhi_hands.STEPS) - 1)
        return rhi_hands.Handled(Session(seed, "", "", 0, 15.0, excess), steps, 0.4)

    monkeypatch.setattr(rhi_hands, "handled", handled)
    monkeypatch.setattr(rhi_hands, "WORKERS", 1)
    touched, free = (
        collisions.Motion(stop, 1.0, "", True, least, inf) for stop, least in (("", -0.01), ("x", 0.02))
    )
    verdict = collisions.Verdict(1, 0.02, free, touched)
    monkeypatch.setattr(giant_collisions, "judge", lambda loaded, seed: verdict)
    for module in (giant_fig6, giant_fig8, giant_fig9):
        monkeypatch.setattr(module, "SECONDS", 0.6)
    for name in ("COUNT", "GRIPS", "SUBSET"):
        monkeypatch.setattr(giant_fig5, name, 50)
    stages = {"solve": {"mean": 2.0}, "log": {"mean": 1.0}}
    compute = {"mean": 4.0, "p999": 5.0, "max": 6.0}
    summary = {
        "ticks": 9,
        "shed": 0,
        "skipped": 1,
        "rate_hz": 1e3,
        "compute_us": compute,
        "stages_us": stages,
    }
    monkeypatch.setattr(giant_timing, "live", lambda seconds: summary)
    resistance = np.full(15, 8.0 + 0.0j)
    along = [Felt(lines(axis), 1.0 / resistance, 1.0 / resistance) for axis in range(3)]
    monkeypatch.setattr(giant_felt, "felt", lambda loaded, changed: along)

    def felt(*_: Any) -> haptify.Felt:
        noise = np.random.default_rng(0).normal(size=(8, 13_000, 3))
        return haptify.Felt(np.arange(13_000) / 1000.0, *noise, "")

    monkeypatch.setattr(haptify, "felt", felt)
    for name, less in {"SECONDS": 5.0, "SETTLED_S": 0.5, "PLANTS": 1}.items():
        monkeypatch.setattr(giant_estimation, name, less)
    built_in = giant_estimation.CASES["the built-in plant"]
    monkeypatch.setattr(giant_estimation, "CASES", {"built-in": built_in})
    monkeypatch.setattr(giant_friction, "felt", lambda loaded, changed: along)
    monkeypatch.setattr(giant_friction, "told", lambda loaded: loaded)
    monkeypatch.setattr(giant_friction, "PLANTS", 1)
    time = np.linspace(giant_operator.FADED_S, 18.0, 200)
    two = np.stack([time, time], axis=1)
    pulls = giant_operator.Felt(time, -0.01 * time, time, 0.1 * two, two, two, standing=True)
    monkeypatch.setattr(giant_operator, "pulled", lambda *_: pulls)
    noise = np.random.default_rng(1).normal(size=(13_000, 6))
    some = np.abs(noise[:, 0])
    session = giant_rules.Session(0.0, np.arange(13_000), some[:6], some[:6], some, 1.0, 1.0, "", 13.0)
    monkeypatch.setattr(giant_rules, "session", lambda *_: session)
    along6 = giant_tracking.Along(noise[:6000], noise[:6000] + 1.0, noise[:6000])
    tracked = giant_tracking.Tracked(along6, along6, 1e3, noise[:0], "astray", 2.0)
    monkeypatch.setattr(giant_tracking, "tracked", lambda *_: tracked)

    def stopped(_: Any, seed: int, force: float) -> giant_stops.Stopped:
        kinds = dict.fromkeys(giant_stops.LEAST, 1e-3)
        cause = giant_stops.CAUSES[seed % 3]
        return giant_stops.Stopped(seed, force, cause, 0.1 * (seed % 6), kinds, kinds, True, "")

    monkeypatch.setattr(giant_stops, "stopped", stopped)
    held = [giant_rest.Held(limit, 1.0, noise[:1000], 20.0, 2.0, "") for limit in giant_rest.HELD_AT]
    monkeypatch.setattr(giant_rest, "held", lambda *_: held)
    monkeypatch.setattr(
        giant_rest, "let_go", lambda _, wrong, when, *__: giant_rest.LetGo(wrong, when, noise, "")
    )
    monkeypatch.setattr(giant_table3, "SAMPLES", 20_000)
    for module in (giant_table1, giant_forces):
        monkeypatch.setattr(module, "POSTURES", 20)
    monkeypatch.setattr(rhi_table1, "identify", lambda device, stiff: TOLD)
    monkeypatch.setattr(bimanual_fig6, "SPEEDS", ())
    monkeypatch.setattr(bimanual_fig6, "SECONDS", 3.0)
    monkeypatch.setattr(bimanual_fig7, "SECONDS", 1.0)
    for module, name, value in (
        (bimanual_link, "DELAYS", (0.03,)),
        (bimanual_link, "LOSSES", (0.0, 0.05)),
        (bimanual_table1, "COUNT", 150),
        (bimanual_table1, "WORKERS", 1),
        (bimanual_table2, "WORKERS", 1),
        (bimanual_table2, "TRIALS", 2),
        (bimanual_table2, "peg_trial", lambda mode, seed: Trial(True, 20.0 + 0.01 * seed, 8.0, "in")),
        (bimanual_touch, "SEEDS", (1, 2)),
        (bimanual_touch, "SECONDS", 0.1),
        (mounting, "FIRST", 10),
        (mounting, "ROUNDS", 1),
        (mounting, "PER_ROUND", 4),
    ):
        monkeypatch.setattr(module, name, value)


@pytest.mark.usefixtures("little_work")
@pytest.mark.parametrize("name", NAMES)
def test_the_plot_of_an_experiment_can_be_read(name: str, tmp_path: Path) -> None:
    outcome: Outcome = import_module(f"hapticd.experiments.{name}").run(lambda text: None)
    found = ["it was not drawn"]

    def draw(figure: Any) -> None:
        outcome.draw(figure)
        found[:] = faults(figure)

    write_plot(tmp_path / "x.svg", Outcome(outcome.rows, outcome.figures, draw, outcome.size))
    assert found == []


def lateness(path: Path) -> None:
    rounds = [jitter.Round([(1.0, 10), (9.0, 2)], 20.0, 0)]
    jitter.draw(dict.fromkeys(jitter.LABELS, rounds), 1000.0, path)


def cold_solves(path: Path) -> None:
    figures = {"median_us": 10.0, "p99_us": 20.0, "exponent": 1.0}
    growth.plot({f"{kind}={n}": {growth.SOLVER: figures} for kind in ("n", "levels") for n in (8, 12)}, path)


@pytest.mark.parametrize("draw", [lateness, cold_solves])
def test_the_plot_of_a_benchmark_can_be_read_and_is_the_same_file_each_time(
    draw: Callable[[Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[str] = ["it was not drawn"]
    for module in (jitter, growth):
        save = module.save

        def look(figure: Any, path: Path, save: Any = save) -> None:
            found[:] = faults(figure)
            save(figure, path)

        monkeypatch.setattr(module, "save", look)
    for name in ("a.svg", "b.svg", "c.png", "d.pdf"):
        draw(tmp_path / name)
        assert found == []
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_plots_that_cannot_be_read_are_found_out() -> None:
    from matplotlib.figure import Figure

    figure = Figure()
    assert list(faults(figure)) == ["nothing is drawn"]
    left, right = figure.subplots(1, 2)
    left.set(xlabel="x", ylabel="y")
    left.plot([0, 1], [0, 1], label="a")
    left.plot([0, 1], [1, 0], label="b")
    right.set(xlabel="x")
    figure.colorbar(right.imshow([[0.0, 1.0]]), ax=right)
    assert list(faults(figure)) == [
        "a colour bar without a label",
        "plot 0: lines that only colour tells apart",
        "plot 0: lines without a legend: ['a', 'b']",
        "plot 1: axis y without a label",
    ]
