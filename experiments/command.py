"""``hapticd experiment``: runs experiments and writes them down."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import msgspec

from ..runtime.command_line.arguments import meant
from ..runtime.invocation import install
from .outcome import ExperimentError, Outcome, Progress, Row, write_plot, write_rows
from .workers import pool_of

NAMES = (
    "rhi_concept",
    "rhi_fig3",
    "rhi_fig6",
    "rhi_fig7",
    "rhi_fig9",
    "rhi_table1",
    "rhi_fig10",
    "rhi_fig11",
    "rhi_taps",
    "rhi_redundancy",
    "rhi_hands",
    "giant_redundancy",
    "giant_collisions",
    "giant_table1",
    "giant_forces",
    "giant_fig5",
    "giant_fig6",
    "giant_fig8",
    "giant_fig9",
    "giant_table3",
    "giant_timing",
    "giant_felt",
    "giant_zwidth",
    "giant_friction",
    "giant_estimation",
    "giant_operator",
    "giant_rules",
    "giant_tracking",
    "giant_stops",
    "giant_rest",
    "bimanual_fig6",
    "bimanual_fig7",
    "bimanual_table1",
    "bimanual_table2",
    "bimanual_touch",
    "bimanual_link",
)
ALONE = ("giant_timing",)
"""What is measured by a clock, and has the processors for itself."""
MACHINES = tuple(dict.fromkeys(name.partition("_")[0] for name in NAMES))
WORKERS = min(2, os.cpu_count() or 1)
SCENES = ("bimanual_table2", "bimanual_touch")
"""Those with objects."""


@dataclass(frozen=True, slots=True)
class Done:
    """What is left of an experiment once its plot is drawn.

    Attributes:
        name, title: of the experiment.
        rows, figures: see ``Outcome``.
        processor_s: what it took of the processors [s].
    """

    name: str
    title: str
    rows: Sequence[Row]
    figures: dict[str, Any]
    processor_s: float


def run(name: str | None, machine: str | None, folder: Path | None, as_json: bool, full: bool) -> int:
    """Run experiments: figures to stdout, plots and tables into a folder if given.

    Args:
        name: of one; None for all.
        machine: of all, those of a machine.
        folder: for plots and tables.
        as_json: print figures as JSON.
        full: many trials where an experiment knows a study of them.

    Raises:
        ExperimentError: no such experiment or machine, one of both too many, MuJoCo or matplotlib is missing,
            or the folder cannot be written.
    """
    if name and machine:
        raise ExperimentError(f"--machine chooses among all experiments; leave it or '{name}' out")
    names = [_known(name)] if name else _of(machine)
    if set(names) & set(SCENES) and not find_spec("mujoco"):
        raise ExperimentError(f"{' and '.join(SCENES)} need MuJoCo; type: {install('mujoco')}")
    if folder and not find_spec("matplotlib"):
        raise ExperimentError(f"plots need matplotlib; type: {install('matplotlib')}")
    for done in _alone(names, folder, full) if len(names) == 1 else _shared(names, folder, full):
        _show(done, folder, as_json)
    if not folder:
        print("no plot was drawn, no table written; --out DIR does both", file=sys.stderr)
    return 0


def perform(name: str, folder: Path | None, full: bool, progress: Progress) -> Done:
    """Run an experiment and draw its plot.

    Raises:
        ExperimentError: the plot cannot be written.
    """
    module: Any = import_module(f".{name}", __package__)
    begin = sum(os.times()[:4])
    outcome: Outcome = (getattr(module, "study", module.run) if full else module.run)(progress)
    spent = sum(os.times()[:4]) - begin
    if folder:
        plot = folder / "figures" / f"{name}.svg"
        try:
            plot.parent.mkdir(parents=True, exist_ok=True)
            write_plot(plot, outcome)
        except OSError as error:
            if plot.is_file():
                plot.unlink()  # half of it is no figure
            raise _unwritten(plot, error) from error
    return Done(name, module.TITLE, outcome.rows, outcome.figures, spent)


def _known(name: str) -> str:
    known = name.replace("-", "_")
    if known not in NAMES:
        raise ExperimentError(f"there is no experiment '{name}'; {meant(known, NAMES)}")
    return known


def _of(machine: str | None) -> Sequence[str]:
    if machine is None:
        return NAMES
    if machine not in MACHINES:
        raise ExperimentError(f"no experiment is of the machine '{machine}'; {meant(machine, MACHINES)}")
    return [name for name in NAMES if name.startswith(f"{machine}_")]


def _alone(names: Sequence[str], folder: Path | None, full: bool) -> Iterator[Done]:
    """One after the other in this process; what each does is told at once."""
    live = sys.stderr.isatty()
    for name in names:

        def progress(what: str, name: str = name) -> None:
            sys.stderr.write(f"\r{name}: {what}\x1b[K" if live else f"{name}: {what}\n")

        done = perform(name, folder, full, progress)
        if live:
            sys.stderr.write("\r\x1b[K")
        yield done


def _shared(names: Sequence[str], folder: Path | None, full: bool) -> Iterator[Done]:
    """In their order, but several at a time; what wants the processors for itself comes last."""
    count = 0

    def tell(future: Future[Done]) -> None:
        nonlocal count
        count += 1
        if not (future.cancelled() or future.exception()):
            done = future.result()
            text = f"{count} of {len(names)}: {done.name}, {done.processor_s:.0f} s of a processor"
            print(text, file=sys.stderr, flush=True)

    with pool_of(WORKERS) as pool:
        futures = [pool.submit(perform, name, folder, full, _quiet) for name in names if name not in ALONE]
        for future in futures:
            future.add_done_callback(tell)
        try:
            for future in futures:
                yield future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
    yield from _alone([name for name in names if name in ALONE], folder, full)


def _quiet(_: str) -> None:
    """Of several at a time each tells only that it is done."""


def _plain(number: Any) -> Any:
    """A number of numpy's, as JSON has it."""
    return number.item()


def _show(done: Done, folder: Path | None, as_json: bool) -> None:
    if as_json:
        print(msgspec.json.encode({"experiment": done.name, **done.figures}, enc_hook=_plain).decode())
    else:
        print("\n".join(_table(done)))
    if not folder:
        return
    page = folder / "fidelity.md"
    try:
        write_rows(page, done.name, done.title, done.rows)
    except OSError as error:
        raise _unwritten(page, error) from error
    print(f"written: {page}, {folder / 'figures' / f'{done.name}.svg'}", file=sys.stderr)


def _unwritten(path: Path, error: OSError) -> ExperimentError:
    """A full disk names no file."""
    return ExperimentError(f"cannot write {error.filename or path}: {error.strerror}")


def _table(done: Done) -> Sequence[str]:
    lines = [f"{done.name}: {done.title}"]
    for row in done.rows:
        lines.append(f"  {row.quantity}: {row.here}  (paper: {row.paper})  {row.remark}".rstrip())
    return lines
