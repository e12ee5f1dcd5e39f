"""The benchmarks on the command line.

Each is imported when it runs: it may need packages that are not installed.
"""

from __future__ import annotations

import argparse
from importlib import import_module
from typing import Any

from ..runtime.command_line.arguments import MAX_RATE, MAX_SECONDS, Commands, count, file, name, number
from ..runtime.command_line.outputs import picture
from ..runtime.errors import HapticdError
from ..runtime.invocation import install

LEAST_TICKS = 100
"""Ticks of a round: fewer have no percentiles."""


class BenchmarkError(HapticdError):
    """A benchmark cannot run as asked."""

    code = "bench"
    exit_status = 2


def add_benchmarks(commands: Commands) -> None:
    """Add `hapticd bench`."""
    bench = commands.add_parser("bench", help="benchmarks", description="Benchmarks.")
    benchmarks = bench.add_subparsers(required=True, metavar="BENCHMARK")
    for add in (_add_solve, _add_jitter, _add_tick, _add_view, _add_nasty):
        add(benchmarks)


def _add_solve(benchmarks: Commands) -> None:
    solve = benchmarks.add_parser(
        "solve",
        help="the solver beside its peers",
        description="Time the solver on recorded problems, cold and warm, beside its peers and a"
        " factorisation floor, and how a cold solve grows with the problem. Peers that are not installed are"
        " named with the command that installs them.",
    )
    problems = solve.add_mutually_exclusive_group()
    problems.add_argument(
        "--data",
        type=file,
        nargs="+",
        metavar="FILE",
        help="recordings; default: those of the giant, and growth",
    )
    problems.add_argument(
        "--humanoid",
        type=count,
        metavar="TICKS",
        help="simulate so many ticks of whole-body control of a humanoid, and solve these",
    )
    solve.add_argument(
        "--seed", type=count, default=1, metavar="N", help="of the humanoid's targets; default: 1"
    )
    problems.add_argument(
        "--qp",
        type=file,
        nargs="+",
        metavar="FOLDER",
        help="time QP solvers on the QPs in these folders instead: clones of qpsolvers' benchmark suites",
    )
    solve.add_argument(
        "--rounds",
        type=count,
        default=5,
        metavar="N",
        help="rounds in which the solvers take turns; default: 5",
    )
    solve.add_argument(
        "--every", type=count, default=100, metavar="N", help="cascades solve every N-th tick; default: 100"
    )
    solve.add_argument("--plot", type=picture, metavar="FILE", help="draw the growth, e.g. as growth.svg")
    solve.add_argument("--json", action="store_true", help="print {data set: {solver: {figure: number}}}")
    solve.set_defaults(handler=_solve)


def _add_jitter(benchmarks: Commands) -> None:
    jitter = benchmarks.add_parser(
        "jitter",
        help="punctuality of the loop",
        description="Lateness of the daemon's loop, with and without spinning, beside cyclictest, a bare C"
        " loop and asyncio's own timers, in alternating rounds.",
    )
    jitter.add_argument("--rate", type=number(MAX_RATE), default=1000.0, metavar="HZ", help="default: 1000")
    jitter.add_argument(
        "--plot", type=picture, metavar="FILE", help="draw the distributions, e.g. as jitter.svg"
    )
    _add_rounds(jitter, 10.0)
    jitter.set_defaults(handler=_jitter)


def _add_tick(benchmarks: Commands) -> None:
    tick = benchmarks.add_parser(
        "tick",
        help="cost of the whole tick, by stage",
        description="Run the whole daemon live on its simulated machine, beside a bare C loop in"
        " alternating rounds; prints the cost of a tick by stage. The giant's hand walks for 30 s from limit"
        " to limit; in shorter rounds the mean tick is cheaper.",
    )
    tick.add_argument(
        "config", type=name, nargs="?", default="giant", metavar="CONFIG", help="default: giant"
    )
    tick.add_argument(
        "--rate",
        type=number(MAX_RATE),
        nargs="+",
        default=[1000.0, 2000.0, 4000.0],
        metavar="HZ",
        help="default: 1000 2000 4000",
    )
    _add_rounds(tick, 30.0)
    tick.set_defaults(handler=_tick)


def _add_view(benchmarks: Commands) -> None:
    view = benchmarks.add_parser(
        "view",
        help="what a dashboard costs the session",
        description="Run live sessions without and with a dashboard in many pages, in alternating rounds; one"
        " page never reads, and the view is killed half-way. Prints the ratios of lateness and cost of a tick"
        " beside the spread of the rounds without one.",
    )
    view.add_argument(
        "config", type=name, nargs="?", default="giant", metavar="CONFIG", help="default: giant"
    )
    view.add_argument("--pages", type=count, default=20, metavar="N", help="default: 20")
    _add_rounds(view, 20.0)
    view.set_defaults(handler=_view)


def _add_rounds(benchmark: argparse.ArgumentParser, seconds: float) -> None:
    benchmark.add_argument("--rounds", type=count, default=5, metavar="N", help="default: 5")
    benchmark.add_argument(
        "--seconds",
        type=number(MAX_SECONDS),
        default=seconds,
        metavar="S",
        help=f"of each round; default: {seconds:g}",
    )
    benchmark.add_argument("--json", action="store_true", help="print the figures as JSON")


def _add_nasty(benchmarks: Commands) -> None:
    nasty = benchmarks.add_parser(
        "nasty",
        help="random hierarchies of every nasty kind",
        description="Solve random hierarchies of every nasty kind and judge each answer by its certificate."
        " Exit status 1 where one is not solved or wrong by more than 1e-6.",
    )
    nasty.add_argument("--count", type=count, default=1000, metavar="N", help="of each kind; default: 1000")
    nasty.add_argument("--json", action="store_true", help="print {kind: {figure: number}}")
    nasty.set_defaults(handler=_nasty)


def _run(name: str, *arguments: object) -> Any:
    try:
        return import_module(f"hapticd.bench.{name}").run(*arguments)
    except ModuleNotFoundError as error:
        package = (error.name or "hapticd").partition(".")[0]
        if package == "hapticd":
            raise
        raise BenchmarkError(f"needs {package}; type: {install(package)}") from error


def _solve(options: argparse.Namespace) -> int:
    if options.qp:
        _run("qps", options.qp, options.rounds, options.json)
        return 0
    humanoid = (options.humanoid, options.seed) if options.humanoid else None
    _run("solve", options.data, options.rounds, options.every, options.plot, options.json, humanoid)
    return 0


def _jitter(options: argparse.Namespace) -> int:
    _require_ticks(options.seconds, options.rate)
    _run("jitter", options.rate, options.rounds, options.seconds, options.plot, options.json)
    return 0


def _tick(options: argparse.Namespace) -> int:
    _require_ticks(options.seconds, *options.rate)
    _run("tick", options.config, options.rate, options.rounds, options.seconds, options.json)
    return 0


def _view(options: argparse.Namespace) -> int:
    _run("view", options.config, options.pages, options.rounds, options.seconds, options.json)
    return 0


def _require_ticks(seconds: float, *rates: float) -> None:
    for rate in rates:
        if seconds * rate < LEAST_TICKS:
            raise BenchmarkError(
                f"a round of {seconds:g} s at {rate:g} Hz has no {LEAST_TICKS} ticks; give more --seconds"
            )


def _nasty(options: argparse.Namespace) -> int:
    return 1 if _run("nasty", options.count, options.json) else 0
