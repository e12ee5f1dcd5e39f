"""``hapticd experiment``: runs experiments and writes them down."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec

from ..runtime.errors import HapticdError
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
)


class ExperimentError(HapticdError):
    """An experiment cannot be run as asked."""

    code = "experiment"
    exit_status = 2


def run(name: str | None, folder: Path, as_json: bool) -> int:
    """Run one experiment, or all without a name: plot and rows into the folder, figures to stdout.

    Raises:
        ExperimentError: no such experiment, or matplotlib is missing.
    """
    names = (name,) if name else NAMES
    for each in names:
        _run(each.replace("-", "_"), folder, as_json)
    return 0


def _run(name: str, folder: Path, as_json: bool) -> None:
    if name not in NAMES:
        near = difflib.get_close_matches(name, NAMES, 1)
        hint = f"did you mean {near[0]}?" if near else f"known: {', '.join(NAMES)}"
        raise ExperimentError(f"no experiment '{name}'; {hint}")
    module: Any = import_module(f".{name}", __package__)
    live = sys.stderr.isatty()

    def progress(what: str) -> None:
        sys.stderr.write(f"\r{name}: {what}\x1b[K" if live else f"{name}: {what}\n")

    outcome: Outcome = module.run(progress)
    if live:
        sys.stderr.write("\r\x1b[K")
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    try:
        write_plot(folder / "figures" / f"{name}.svg", outcome)
    except ImportError as error:
        raise ExperimentError("plots need matplotlib; install hapticd[plot]") from error
    write_rows(folder / "fidelity.md", name, module.TITLE, outcome.rows)
    if as_json:
        print(msgspec.json.encode({"experiment": name, **outcome.figures}).decode())
    else:
        print("\n".join(_table(name, module.TITLE, outcome)))


def _table(name: str, title: str, outcome: Outcome) -> Sequence[str]:
    lines = [f"{name}: {title}"]
    for row in outcome.rows:
        lines.append(f"  {row.quantity}: {row.here}  (paper: {row.paper})  {row.note}".rstrip())
    return lines
