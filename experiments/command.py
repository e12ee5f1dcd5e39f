"""``hapticd experiment``: runs experiments and writes them down."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import msgspec

from ..runtime.command_line.arguments import meant
from ..runtime.errors import HapticdError
from ..runtime.invocation import install
from .outcome import Outcome, write_plot, write_rows

NAMES = (
    "rhi_fig3",
    "rhi_fig6",
    "rhi_fig7",
    "rhi_fig9",
    "rhi_table1",
    "rhi_fig10",
    "rhi_fig11",
    "giant_redundancy",
    "giant_fig8",
    "giant_fig9",
    "bimanual_fig6",
    "bimanual_fig7",
    "bimanual_table1",
)


class ExperimentError(HapticdError):
    """An experiment cannot be run as asked."""

    code = "experiment"
    exit_status = 2


def run(name: str | None, folder: Path | None, as_json: bool) -> int:
    """Run one experiment, or all without a name: figures to stdout, plots and tables into a folder if given.

    Raises:
        ExperimentError: no such experiment, matplotlib is missing, or the folder cannot be written.
    """
    names = [_known(name)] if name else NAMES
    if folder and not find_spec("matplotlib"):
        raise ExperimentError(f"plots need matplotlib; type: {install('matplotlib')}")
    for each in names:
        _run(each, folder, as_json)
    if not folder:
        print("no plot was drawn, no table written; --out DIR does both", file=sys.stderr)
    return 0


def _known(name: str) -> str:
    known = name.replace("-", "_")
    if known not in NAMES:
        raise ExperimentError(f"there is no experiment '{name}'; {meant(known, NAMES)}")
    return known


def _run(name: str, folder: Path | None, as_json: bool) -> None:
    module: Any = import_module(f".{name}", __package__)
    live = sys.stderr.isatty()

    def progress(what: str) -> None:
        sys.stderr.write(f"\r{name}: {what}\x1b[K" if live else f"{name}: {what}\n")

    outcome: Outcome = module.run(progress)
    if live:
        sys.stderr.write("\r\x1b[K")
    if as_json:
        print(msgspec.json.encode({"experiment": name, **outcome.figures}).decode())
    else:
        print("\n".join(_table(name, module.TITLE, outcome)))
    if not folder:
        return
    plot, page = folder / "figures" / f"{name}.svg", folder / "fidelity.md"
    try:
        plot.parent.mkdir(parents=True, exist_ok=True)
        write_plot(plot, outcome)
        write_rows(page, name, module.TITLE, outcome.rows)
    except OSError as error:
        raise ExperimentError(f"cannot write {error.filename}: {error.strerror}") from error
    print(f"written: {page}, {plot}", file=sys.stderr)


def _table(name: str, title: str, outcome: Outcome) -> Sequence[str]:
    lines = [f"{name}: {title}"]
    for row in outcome.rows:
        lines.append(f"  {row.quantity}: {row.here}  (paper: {row.paper})  {row.note}".rstrip())
    return lines
