"""`hapticd bench`: its figures, its tables, and what it says when something is missing."""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hapticd.bench import cascades, growth, solve
from hapticd.bench.contenders import Answer, Contender, DaqpHierarchical, Floor, Ours
from hapticd.bench.figures import FAULTS, PERCENTILES, count_wrong, summary, table
from hapticd.bench.recorded import Recording, load, shipped
from hapticd.binding import pointer
from hapticd.hqp.certificate import slack_norms
from hapticd.hqp.core import best
from hapticd.hqp.generate import KINDS
from hapticd.runtime.command_line.cli import main

CYCLING = shipped()[3]
FIGURES = {
    *("median_us", "p99_us", "p999_us", "max_us", "iterations_mean", "iterations_max"),
    *("wrong_1e6", "wrong_1e4", "wrong_1e2"),
}
Run = Callable[..., str]


DAQP = find_spec("daqp") is not None
"""Whether the peer is installed that solves other weights on rows of any length."""


@pytest.fixture
def cycling() -> Recording:
    return load(CYCLING)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def bench_solve(*arguments: str, status: int = 0) -> str:
        assert main(["bench", "solve", "--rounds", "1", "--data", str(CYCLING), *arguments]) == status
        taken = capsys.readouterr()
        return taken.err if status else taken.out

    return bench_solve


def answers(*times: float) -> list[Answer]:
    return [Answer(us, np.zeros(1), 3, True) for us in times]


def test_figures_come_as_json(run: Run) -> None:
    figures = json.loads(run("--json"))
    if DAQP:
        assert "DAQP hierarchical" in figures.pop("cycling, rows normalised")
    assert list(figures) == ["cycling"]
    for name in ("hapticd cold", "hapticd warm", "floor", "quadprog cascade"):
        values = figures["cycling"][name]
        assert set(values) >= FIGURES, name
        assert 0 < values["median_us"] <= values["p99_us"] <= values["p999_us"] <= values["max_us"]
    for name in ("hapticd cold", "hapticd warm", "floor"):
        assert figures["cycling"][name]["wrong_1e6"] == 0


def test_the_table_ends_with_the_ratio_to_the_floor(run: Run) -> None:
    lines = run().splitlines()
    if DAQP:
        assert lines[-1].startswith("  DAQP hierarchical takes") and "cycling, rows normalised" in lines
    assert lines[0] == "cycling" and "p99.9" in lines[1] and lines[2].startswith("  hapticd cold")
    assert max(map(len, lines)) <= 80
    assert sum("times the floor" in line for line in lines) == 1


def test_the_table_says_who_is_not_right_on_every_tick() -> None:
    times = dict.fromkeys(PERCENTILES, 123456.78) | {"iterations_mean": 9.5, "iterations_max": 10.0}
    right = times | dict.fromkeys(FAULTS, 0.0) | {"ticks": 2000.0}
    wrong = right | {"wrong_1e6": 54.0, "failed": 3.0}
    lines = list(table({"hapticd warm": right, "DAQP hierarchical": wrong}))
    assert len(lines) == 4 and max(map(len, lines)) <= 80
    assert lines[1].split()[2:] == ["123456.8"] * 4 + ["9.5", "10", "2000"]
    assert lines[3] == "  DAQP hierarchical: 54 wrong by 1e-6, 3 failed"


def test_the_floor_and_daqp_are_compared_in_the_ratios() -> None:
    medians = {"hapticd warm": 10.0, "floor": 4.0, "DAQP hierarchical": 50.0}
    figures = {name: {"median_us": us, "p99_us": 2.0 * us} for name, us in medians.items()}
    assert list(solve._ratios(figures)) == [
        "  hapticd warm takes 2.50 times the floor",
        "  DAQP hierarchical takes 5.00 times hapticd warm, at p99 5.00 times",
    ]


def test_a_peer_that_is_not_installed_is_skipped_and_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    find = solve.find_spec
    monkeypatch.setattr(solve, "find_spec", lambda name: None if name in ("daqp", "quadprog") else find(name))
    assert main(["bench", "solve", "--rounds", "1", "--data", str(CYCLING), "--json"]) == 0
    taken = capsys.readouterr()
    assert not {"DAQP hierarchical", "DAQP cascade", "quadprog cascade"} & set(
        json.loads(taken.out)["cycling"]
    )
    assert "DAQP hierarchical is skipped: daqp is not installed; " in taken.err
    assert "-m pip install daqp==" in taken.err


def test_the_time_of_a_problem_is_its_median_over_the_rounds() -> None:
    found = summary([answers(1, 2, 90), answers(1, 80, 3), answers(70, 2, 3)])
    assert (found["median_us"], found["max_us"]) == (2, 3)
    assert (found["iterations_mean"], found["not_solved"]) == (3, 0)


def one_in(step: int, recording: Recording) -> Recording:
    parts = [tuple(array[::step] for array in part) for part in recording.parts]
    return replace(
        recording,
        group=recording.group[::step],
        x=recording.x[::step],
        norms=recording.norms[::step],
        parts=parts,
    )


def test_the_floor_reaches_the_recorded_optimum() -> None:
    for path in shipped():
        recording = one_in(41, load(path))
        floor = Floor(recording)
        for tick, levels in recording.replay():
            found = floor.solve(tick, levels).x
            assert np.abs(found - recording.x[tick]).max() < 1e-6 * (1 + np.abs(recording.x[tick]).max()), (
                tick
            )


def null_space_cascade(counts: list[int], rows: np.ndarray, target: np.ndarray) -> np.ndarray:
    x, free, first = np.zeros(rows.shape[1]), np.eye(rows.shape[1]), 0
    for count in counts:
        A, b = rows[first : first + count], target[first : first + count]
        first += count
        reduced = A @ free
        if not reduced.size or np.abs(reduced).max() < 1e-9:
            continue
        x = x + free @ np.linalg.lstsq(reduced, b - A @ x, rcond=1e-9)[0]
        free = free @ np.linalg.svd(reduced)[2][np.linalg.matrix_rank(reduced, 1e-9) :].T
    return x


@pytest.mark.parametrize("n", [1, 5, 8, 31])
@pytest.mark.parametrize("build", [import_module, best])
def test_the_floor_solves_conflicting_and_dependent_levels(
    n: int, build: Callable[[str, None], ModuleType]
) -> None:
    floor = build("hapticd.bench._floor", None)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        counts = [int(count) for count in rng.integers(0, n + 3, size=4)]
        rows = rng.normal(size=(sum(counts), n))
        rows[1::4] = rows[: len(rows[1::4])]  # within levels and across them
        rows[3::7] = 0.0
        target = rng.normal(size=sum(counts))
        x = np.zeros(n)
        buffers = [pointer(array, "double", *array.shape) for array in (rows, target, x)]
        work = floor.ffi.new("double[]", floor.lib.floor_work(n, sum(counts)))
        rank = floor.lib.floor_solve(n, 4, counts, buffers[0], buffers[1], work, buffers[2])
        assert rank == (np.linalg.matrix_rank(rows) if len(rows) else 0)
        assert np.allclose(x, null_space_cascade(counts, rows, target), atol=1e-9)


def test_a_wrong_point_is_counted_and_a_better_one_is_not(cycling: Recording) -> None:
    off = cycling.x[0] + 1e-4
    found = count_wrong(cycling, {0: off, 1: cycling.x[1]})
    assert (found["wrong_1e6"], found["wrong_1e4"], found["wrong_1e2"], found["better"]) == (1, 1, 0, 0)
    excavator = load(shipped()[1])
    improved = Ours(excavator, warm=False).solve(416, excavator.levels(416)).x
    found = count_wrong(excavator, {416: improved})
    assert (found["wrong_1e6"], found["better"]) == (0, 1)


def test_daqp_solves_hierarchically(cycling: Recording) -> None:
    pytest.importorskip("daqp")
    excavator = load(shipped()[1])
    daqp: Contender = DaqpHierarchical(excavator)
    levels = excavator.levels(0)
    answer = daqp.solve(0, levels)
    assert answer.solved and answer.iterations > 0 and answer.us > 0
    assert np.allclose(slack_norms(levels, answer.x), excavator.norms[0], atol=1e-4)


@pytest.mark.parametrize("name", cascades.QPS)
def test_a_cascade_comes_close_to_the_optimum(name: str) -> None:
    pytest.importorskip(cascades.QPS[name].package)
    door = load(shipped()[2])
    answer = cascades.solve_cascade(name, door.levels(0))
    assert answer is not None and answer.us > 0 and answer.iterations > 0
    assert np.allclose(slack_norms(door.levels(0), answer.x), door.norms[0], atol=1e-3)


def _hang(*_: object) -> None:
    while True:
        pass


def _give_up(*_: object) -> None:
    raise cascades.QpError("no")


def test_a_cascade_that_hangs_is_replaced_and_spared_the_problem(
    cycling: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(cascades.QPS, "test", cascades.Qp("", _hang))
    monkeypatch.setattr(cascades, "HANGS_S", 0.3)
    cascade = cascades.Cascade("test")
    assert cascade.solve(0, cycling.levels(0)) is None
    assert cascade.hopeless == {0} and cascade.solve(0, cycling.levels(0)) is None
    cascade.close()


def test_a_cascade_whose_solver_gives_up_has_no_answer(
    cycling: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(cascades.QPS, "test", cascades.Qp("", _give_up))
    assert cascades.solve_cascade("test", cycling.levels(0)) is None


def test_the_exponent_of_a_power_law_is_found() -> None:
    sizes = [8.0, 12.0, 30.0, 60.0]
    assert growth.exponent(sizes, [0.7 * n**2.6 for n in sizes]) == pytest.approx(2.6)


@pytest.fixture
def small_growth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growth, "SIZES", (6, 9, 12, 15))
    monkeypatch.setattr(growth, "LEVELS", (2, 3, 4, 5))
    monkeypatch.setattr(growth, "SEEDS", 4)


@pytest.mark.usefixtures("small_growth")
def test_growth_has_the_figures_of_a_data_set_and_an_exponent() -> None:
    grown = growth.growth(1)
    assert list(grown) == [
        *(f"n={n}" for n in (6, 9, 12, 15)),
        *(f"levels={count}" for count in (2, 3, 4, 5)),
    ]
    for solvers in grown.values():
        values = solvers["hapticd cold"]
        assert set(values) >= FIGURES and values["wrong_1e6"] == 0
    slope = np.log(grown["n=15"]["hapticd cold"]["median_us"] / grown["n=12"]["hapticd cold"]["median_us"])
    fitted = grown["n=6"]["hapticd cold"]["exponent_upper_half"]
    assert fitted == pytest.approx(slope / np.log(15 / 12))
    lines = list(growth.lines_of_growth(grown))
    assert len(lines) == 10 and lines[-2].startswith("cold median ~ n^")


@pytest.mark.usefixtures("small_growth")
def test_growth_is_drawn(run: Run, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    assert "cold median ~ n^" in run("--plot", str(tmp_path / "growth.svg"))
    assert "<svg" in (tmp_path / "growth.svg").read_text()
    with pytest.raises(SystemExit) as end:
        run("--plot", str(tmp_path / "none" / "growth.svg"))
    assert end.value.code == 2  # before any solver ran


def test_a_plot_without_matplotlib_is_refused_with_what_to_install(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "matplotlib", None)
    assert "--plot needs matplotlib; type: " in run("--plot", "growth.svg", status=2)


@pytest.mark.parametrize(
    ("content", "why"),
    [(None, "No such file"), (b"hello", "it is no .npz file;"), (b"", "it is no .npz file;")],
)
def test_a_file_that_is_no_recording_is_refused(
    content: bytes | None, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.npz"
    if content is not None:
        path.write_bytes(content)
    assert main(["bench", "solve", "--data", str(path), "--json"]) == 2
    error = json.loads(capsys.readouterr().out)
    assert error["error"] == "bench" and why in error["message"] and str(path) in error["message"]


def test_the_nasty_sweep_judges_every_kind(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "nasty", "--count", "2", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert len(found) == len(KINDS)
    assert all(
        (kind["solved"], kind["wrong_1e6"]) == (2, 0) and kind["worst"] < 1e-6 for kind in found.values()
    )


def test_the_nasty_sweep_fails_where_an_answer_is_refuted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("hapticd.bench.nasty.certificate", lambda levels, x: np.array([1e-3]))
    assert main(["bench", "nasty", "--count", "1"]) == 1
    assert "1.0e-03" in capsys.readouterr().out.splitlines()[1]


@pytest.mark.parametrize(
    "arguments", [["bench"], ["bench", "solve", "--rounds", "0"], ["bench", "nasty", "--count", "x"]]
)
def test_bad_usage_is_refused(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2


def test_one_kind_of_problems_is_timed_at_a_time(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["bench", "solve", "--humanoid", "5", "--data", str(CYCLING)])
    assert ended.value.code == 2 and "--data: not allowed with argument --humanoid" in capsys.readouterr().err
