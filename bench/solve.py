"""Times the solver on recorded problems beside its peers and the floor, all taking turns in every round."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from ..runtime.invocation import install
from .cascades import QPS, Cascade
from .contenders import Answer, Contender, DaqpHierarchical, Floor, Ours
from .figures import Figures, count_wrong, progress, summary, table
from .growth import growth, lines_of_growth, plot
from .humanoid import humanoid
from .picture import pyplot
from .recorded import Recording, load, normalised, shipped

PEER = "DAQP hierarchical"
PACKAGES = {PEER: "daqp", **{name: qp.package for name, qp in QPS.items()}}
CONTENDERS: dict[str, Callable[[Recording], Contender]] = {
    "hapticd cold": lambda recording: Ours(recording, warm=False),
    "hapticd warm": lambda recording: Ours(recording, warm=True),
    "floor": Floor,
}
NORMALISED: dict[str, Callable[[Recording], Contender]] = {
    "hapticd cold": CONTENDERS["hapticd cold"],
    "hapticd warm": CONTENDERS["hapticd warm"],
    PEER: DaqpHierarchical,
}
"""Those that are compared with DAQP, on rows of length 1: it scales them anyway."""

Round = Mapping[int, Answer | None]  # by tick; None where the solver gave up


def run(
    data: Sequence[Path] | None,
    rounds: int,
    every: int,
    picture: Path | None,
    as_json: bool,
    simulated: tuple[int, int] | None = None,
) -> None:
    """Run the benchmark and print a table, or one JSON object {data set: {solver: {figure: number}}}.

    Args:
        data: recordings; None: those of the package, and the growth with n and levels too.
        rounds: how often the solvers take turns; the time of a tick is its median over the rounds.
        every: cascades, which are slow, solve every so many ticks.
        picture: file for a plot of the growth, which is then measured with any data.
        as_json: print JSON.
        simulated: ticks and seed of a simulated humanoid, in the place of the recordings.

    Raises:
        BenchError: a file that is no recording, or a plot without matplotlib.
    """
    if simulated:
        recordings = [humanoid(*simulated)]
    else:
        recordings = [load(path) for path in (shipped() if data is None else data)]
    if picture:
        pyplot()  # missing: better said now than after the measurement
    figures = {
        recording.name: _solvers(recording, rounds, every, CONTENDERS, QPS) for recording in recordings
    }
    if _installed(PEER):
        for same in map(normalised, recordings):
            figures[same.name] = _solvers(same, rounds, every, NORMALISED, ())
    grown = growth(rounds) if picture or (data is None and not simulated) else {}
    if picture:
        plot(grown, picture)
    if as_json:
        json.dump({**figures, **grown}, sys.stdout, indent=2)
        print()
        return
    for dataset, solvers in figures.items():
        print(dataset, *table(solvers), *_ratios(solvers), sep="\n")
    for line in lines_of_growth(grown):
        print(line)


def _solvers(
    recording: Recording,
    rounds: int,
    every: int,
    made: Mapping[str, Callable[[Recording], Contender]],
    cascaded: Iterable[str],
) -> dict[str, Figures]:
    """Figures of these contenders and of the cascades that are installed."""
    print(f"{recording.name}: {len(recording)} ticks, n = {recording.x.shape[1]}", file=sys.stderr)
    contenders = {name: make(recording) for name, make in made.items()}
    cascades = {name: Cascade(name) for name in cascaded if _installed(name)}
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
    ended = [tick for tick, answer in rounds[-1].items() if answer]
    points = {tick: answer.x for tick, answer in rounds[-1].items() if answer and answer.solved}
    return {
        **summary([[answer for tick in ended if (answer := taken[tick])] for taken in rounds]),
        **count_wrong(recording, points),
        "failed": float(len(rounds[-1]) - len(ended)),
        "ticks": float(len(rounds[-1])),
    }


def _ratios(solvers: dict[str, Figures]) -> Iterator[str]:
    """How the warm median compares with the floor and with DAQP."""
    warm = solvers["hapticd warm"]
    if "floor" in solvers:
        floor = warm["median_us"] / solvers["floor"]["median_us"]
        yield f"  hapticd warm takes {floor:.2f} times the floor"
    if PEER in solvers:
        median, p99 = (solvers[PEER][key] / warm[key] for key in ("median_us", "p99_us"))
        yield f"  {PEER} takes {median:.2f} times hapticd warm, at p99 {p99:.2f} times"
