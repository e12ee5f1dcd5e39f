"""Times the solver on recorded problems, cold and warm, beside a cascade of QPs on quadprog."""

import argparse
import json
import multiprocessing
import sys
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from hapticd.hqp import Solver
from hapticd.hqp.certificate import certificate, slack_norms
from hapticd.hqp.reference import first_mismatch, reference
from numpy.typing import NDArray
from recorded import DATA, Recording, load

TOLERANCES = {"wrong_1e6": 1e-6, "wrong_1e4": 1e-4, "wrong_1e2": 1e-2}
HANGS_S = 5.0  # quadprog runs for ever on some degenerate sets

Figures = dict[str, float]


def main() -> None:
    """Run the benchmark and print a table, or JSON."""
    args = _arguments()
    figures = {}
    for path in args.data:
        recording = load(path)
        print(f"{recording.name}: {len(recording)} ticks, n = {recording.x.shape[1]}", file=sys.stderr)
        ours = _interleave(recording, args.rounds)
        figures[recording.name] = {
            "hapticd cold": ours[0],
            "hapticd warm": ours[1],
            "quadprog cascade": _time_cascade(recording, args.every),
        }
    if args.json:
        json.dump(figures, sys.stdout, indent=2)
        print()
    else:
        _print_table(figures)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    names = ("cartesian", "excavator", "door", "cycling")
    parser.add_argument("--data", type=Path, nargs="+", default=[DATA / f"hqp_{name}.npz" for name in names])
    parser.add_argument("--rounds", type=int, default=5, help="rounds of cold and warm, in turn")
    parser.add_argument("--every", type=int, default=25, help="the cascade solves every so many ticks")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def _interleave(recording: Recording, rounds: int) -> list[Figures]:
    """Cold and warm in turn; each percentile is the median over the rounds."""
    solver = Solver(recording.x.shape[1], [(p[0].shape[1], p[2].shape[1]) for p in recording.parts])
    runs: list[list[Figures]] = [[], []]
    for _ in _progress("rounds", range(rounds)):
        for warm in (False, True):
            runs[warm].append(_time_solver(recording, solver, warm))
    return [{key: float(np.median([run[key] for run in of_kind])) for key in of_kind[0]} for of_kind in runs]


def _time_solver(recording: Recording, solver: Solver, warm: bool) -> Figures:
    count = len(recording)
    times, iterations = np.zeros(count), np.zeros(count)
    x, norms, statuses = np.zeros_like(recording.x), np.zeros_like(recording.norms), np.zeros(count)
    for tick, levels in recording.replay():
        if not (warm and recording.follows(tick)):
            solver.reset()
        start = time.perf_counter_ns()
        solution = solver.solve(levels)
        times[tick] = 1e-3 * (time.perf_counter_ns() - start)
        iterations[tick], statuses[tick], x[tick] = solution.iterations, solution.status, solution.x
        norms[tick] = [np.sqrt(w @ w + v @ v) for w, v in zip(solution.w, solution.v, strict=True)]
    return {
        **_percentiles(times),
        "iterations_mean": float(iterations.mean()),
        "iterations_max": float(iterations.max()),
        **_count_wrong(recording, range(count), x, norms),
        "not_solved": float(np.sum(statuses != 0)),
    }


def _percentiles(times: NDArray[np.float64]) -> Figures:
    names = {"median_us": 50.0, "p99_us": 99.0, "p999_us": 99.9, "max_us": 100.0}
    return {name: float(np.percentile(times, q)) for name, q in names.items()}


def _count_wrong(
    recording: Recording, ticks: range, x: NDArray[np.float64], norms: NDArray[np.float64]
) -> Figures:
    """Ticks whose slack norms differ from the recorded ones.

    Where ours are lexicographically smaller, and our certificate is smaller than that of the recorded point,
    it is the recording that is not optimal: such ticks are counted as `better`, not as wrong.
    """
    wrong = dict.fromkeys(TOLERANCES, 0.0)
    better = 0.0
    for i, tick in enumerate(ticks):
        at = first_mismatch(norms[i], recording.norms[tick], 1e-6)
        if at is None:
            continue
        levels = recording.levels(tick)
        proven = certificate(levels, x[i]).max() < certificate(levels, recording.x[tick]).max()
        if norms[i][at] < recording.norms[tick][at] and proven:
            better += 1
            continue
        for name, tolerance in TOLERANCES.items():
            wrong[name] += first_mismatch(norms[i], recording.norms[tick], tolerance) is not None
    return {**wrong, "better": better}


def _time_cascade(recording: Recording, every: int) -> Figures:
    """The cascade on some of the ticks, in a process of its own that is replaced when it hangs."""
    ticks = range(0, len(recording), every)
    times, x = [], np.full((len(ticks), recording.x.shape[1]), np.nan)
    failed = 0.0
    parent, worker = _start_worker(_cascade_worker)
    for i, tick in enumerate(_progress("cascade", ticks)):
        parent.send(recording.levels(tick))
        if not parent.poll(HANGS_S):
            worker.kill()
            parent, worker = _start_worker(_cascade_worker)
            failed += 1
            continue
        answer = parent.recv()
        if answer is None:
            failed += 1
            continue
        x[i] = answer[0]
        times.append(answer[1])
    worker.kill()
    done = [i for i in range(len(ticks)) if np.isfinite(x[i]).all()]
    wrong = dict.fromkeys(TOLERANCES, 0.0)
    for i in done:
        norms = slack_norms(recording.levels(ticks[i]), x[i])
        for name, tolerance in TOLERANCES.items():
            wrong[name] += first_mismatch(norms, recording.norms[ticks[i]], tolerance) is not None
    return {
        **_percentiles(np.array(times or [np.nan])),
        "ticks": float(len(ticks)),
        **wrong,
        "failed": failed,
    }


def _start_worker(target: Callable[[Connection], None]) -> tuple[Connection, multiprocessing.Process]:
    parent, child = multiprocessing.Pipe()
    worker = multiprocessing.Process(target=target, args=(child,), daemon=True)
    worker.start()
    return parent, worker


def _cascade_worker(pipe: Connection) -> None:
    while True:
        levels = pipe.recv()
        start = time.perf_counter_ns()
        try:
            answer = reference(levels)
        except ValueError:  # quadprog finds constraints inconsistent that are not
            pipe.send(None)
        else:
            pipe.send((answer, 1e-3 * (time.perf_counter_ns() - start)))


def _progress(what: str, items: range) -> Iterator[int]:
    for done, item in enumerate(items, start=1):
        yield item
        if sys.stderr.isatty() or done == len(items):
            print(f"\r  {what} {done}/{len(items)}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)


def _print_table(figures: dict[str, dict[str, Figures]]) -> None:
    columns = {
        "median_us": "median",
        "p99_us": "p99",
        "p999_us": "p99.9",
        "max_us": "max us",
        "iterations_mean": "iterations",
        "iterations_max": "most",
        **{name: name.replace("_", " ") for name in TOLERANCES},
        "better": "better",
        "not_solved": "not solved",
        "failed": "failed",
    }
    print(f"{'':27}" + "".join(f"{title:>11}" for title in columns.values()))
    for dataset, solvers in figures.items():
        for solver, values in solvers.items():
            digits = {key: 1 if key.endswith(("us", "mean")) else 0 for key in columns}
            cells = (f"{values[k]:11.{digits[k]}f}" if k in values else " " * 11 for k in columns)
            print(f"{dataset + ' ' + solver:27}" + "".join(cells))


if __name__ == "__main__":
    main()
