"""What an experiment hands back, and how it is written down."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..runtime.errors import HapticdError

HEAD = """# Fidelity

Every figure and table of the papers that can be run in simulation: the paper's number beside ours. Written by
`make fidelity`; each experiment replaces its own section. Where the paper's number cannot be
reproduced from its text, the note says why. Everything is simulated or computed; what a clock measured is
marked as a timing and differs from run to run.
"""
COLUMNS = "| quantity | paper | here | note |\n|---|---|---|---|\n"
COLOURS, LINES = ("tab:blue", "tab:orange", "tab:green", "tab:red"), ("-", "--", "-.", ":")
"""Styles of the lines of a plot: told apart without colour, too."""
Progress = Callable[[str], None]
Draw = Callable[[Any], None]
"""Draws on an empty matplotlib figure."""


class ExperimentError(HapticdError):
    """An experiment cannot be run as asked."""

    code = "experiment"
    exit_status = 2


@dataclass(frozen=True, slots=True)
class Row:
    """A quantity: as the paper has it ("-" where it has none), as it came out here, and a remark.

    Attributes:
        timing: whether it was measured by a clock, and differs from run to run.
    """

    quantity: str
    paper: str
    here: str
    note: str = ""
    timing: bool = False

    @property
    def remark(self) -> str:
        """The note, marked where it is of a timing."""
        return "; ".join(part for part in ("timing" if self.timing else "", self.note) if part)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of an experiment.

    Attributes:
        rows: for docs/fidelity.md.
        figures: plain numbers by name, for --json.
        draw: draws the plot.
        size: of the plot, width and height [inch].
    """

    rows: Sequence[Row]
    figures: dict[str, Any]
    draw: Draw
    size: tuple[float, float] = (8.0, 4.5)


def write_rows(page: Path, name: str, title: str, rows: Sequence[Row]) -> None:
    """Replace the section of an experiment in the page, or append it."""
    text = page.read_text(encoding="utf-8") if page.exists() else HEAD
    heading = f"## {name}: "
    before, found, rest = text.partition(f"\n{heading}")
    after = rest.partition("\n## ")[2] if found else ""
    cells = (f"| {r.quantity} | {r.paper} | {r.here} | {r.remark} |" for r in rows)
    body = f"\n{heading}{title}\n\n![{title}](figures/{name}.svg)\n\n{COLUMNS}" + "\n".join(cells) + "\n"
    page.write_text(before.rstrip("\n") + "\n" + body + (f"\n## {after}" if after else ""), encoding="utf-8")


def write_plot(path: Path, outcome: Outcome) -> None:
    """Draw an outcome as SVG, the same bytes for the same numbers.

    Raises:
        ImportError: matplotlib is not installed.
    """
    import matplotlib
    from cycler import cycler
    from matplotlib.figure import Figure

    style: Any = {
        "svg.hashsalt": "hapticd",
        "font.size": 9,
        "axes.grid": True,
        "axes.prop_cycle": cycler(color=COLOURS) + cycler(linestyle=LINES),
    }
    with matplotlib.rc_context(style):
        figure = Figure(figsize=outcome.size, layout="constrained")
        outcome.draw(figure)
        figure.savefig(path, metadata={"Date": None})
