"""Times the solver on recorded problems beside its peers and the floor, all taking turns in every round."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from ..runtime.invocation import install
from .cascades import QPS, Cascade
from .contenders import Answer, Contender, DaqpHierarchical, Floor, Ours
from .figures import Figures, count_wrong, progress, summary, table
from .growth import growth, lines_of_growth, plot
from .picture import pyplot
from .recorded import Recording, load, shipped

PEER = "DAQP hierarchical"
PACKAGES = {PEER: "daqp", **{name: qp.package for name, qp in QPS.items()}}
CONTENDERS: dict[str, Callable[[Recording], Contender]] = {
    "hapticd cold": lambda recording: Ours(recording, warm=False),
    "hapticd warm": lambda recording: Ours(recording, warm=True),
    "floor": Floor,
    PEER: DaqpHierarchical,
}

Round = Mapping[int, Answer | None]  # by tick; None where the solver gave up


def run(data: Sequence[Path] | None, rounds: int, every: int, picture: Path | None, as_json: bool) -> None:
    """Run the benchmark and print a table, or one JSON object {data set: {solver: {figure: number}}}.

    Args:
        data: recordings; None: those of the package, and the growth with n and levels too.
        rounds: how often the solvers take turns; the time of a tick is its median over the rounds.
        every: cascades, which are slow, solve every so many ticks.
        picture: file for a plot of the growth, which is then measured with any data.
        as_json: print JSON.

    Raises:
        BenchError: a file that is no recording, or a plot without matplotlib.
    """
    recordings = [load(path) for path in (shipped() if data is None else data)]
    if picture:
        pyplot()  # missing: better said now than after the measurement
    figures = {recording.name: _solvers(recording, rounds, every) for recording in recordings}
    grown = growth(rounds) if data is None or picture else {}
    if picture:
        plot(grown, picture)
    if as_json:
        json.dump({**figures, **grown}, sys.stdout, indent=2)
        print()
        return
    print(*table(figures), *_ratios(figures), *lines_of_growth(grown), sep="\n")


def _solvers(recording: Recording, rounds: int, every: int) -> dict[str, Figures]:
    """Figures of every solver that is installed."""
    print(f"{recording.name}: {len(recording)} ticks, n = {recording.x.shape[1]}", file=sys.stderr)
    contenders = {name: make(recording) for name, make in CONTENDERS.items() if _installed(name)}
    cascades = {name: Cascade(name) for name in QPS if _installed(name)}
    taken: dict[str, list[Round]] = {name: [] for name in (*contenders, *cascades)}
    for _ in progress("rounds", range(rounds), rounds):
        for name, contender in contenders.items():
            taken[name].append({t: contender.solve(t, levels) for t, levels in recording.replay()})
        for name, cascade in cascades.items():
            ticks = range(0, len(recording), every)
            taken[name].append({t: cascade.solve(t, levels) for t, levels in recording.replay(ticks)})
    for cascade in cascades.values():
        cascade.close()
    return {name: _figures(recording, of_rounds) for name, of_rounds in taken.items()}


def _installed(name: str) -> bool:
    package = PACKAGES.get(name)
    if not package or find_spec(package):
        return True
    print(f"  {name} is skipped: {package} is not installed; {install(package)}", file=sys.stderr)
    return False


def _figures(recording: Recording, rounds: Sequence[Round]) -> Figures:
    points = {tick: answer.x for tick, answer in rounds[-1].items() if answer}
    return {
        **summary([[answer for tick in points if (answer := taken[tick])] for taken in rounds]),
        **count_wrong(recording, points),
        "failed": float(len(rounds[-1]) - len(points)),
        "ticks": float(len(rounds[-1])),
    }


def _ratios(figures: dict[str, dict[str, Figures]]) -> Iterator[str]:
    """How the warm median compares with the floor and with DAQP."""
    for dataset, solvers in figures.items():
        warm, floor = solvers["hapticd warm"]["median_us"], solvers["floor"]["median_us"]
        line = f"{dataset}: hapticd warm takes {warm / floor:.2f} times the floor"
        if PEER in solvers:
            line += f"; {PEER} takes {solvers[PEER]['median_us'] / warm:.2f} times hapticd warm"
        yield line
