"""Bimanual, Table I: what the operator arm reaches of a hand's poses by its mounting."""

from __future__ import annotations

import os

from .mount import PAPER, draw, mounted
from .outcome import Outcome, Progress, Row
from .seated_operator import COUNT

WORKERS = os.cpu_count() or 1
TITLE = "workspace of the operator arm (Table I), in simulation"
SYNTHETIC = "in simulation: poses of a synthetic arm with joint limits, not of a recorded person"
START = "the start value is that of the mounting one starts from"


def run(progress: Progress) -> Outcome:
    """Search as `hapticd mount` does."""
    progress("search")
    found = mounted(COUNT, 1, WORKERS, lambda _: None)
    rows = []
    for name, mask, note in (("initial", found.before, START), ("optimised", found.after, SYNTHETIC)):
        hit, missed, share = PAPER[name]
        here = f"{int(mask.sum())} / {int((~mask).sum())}, {100 * mask.mean():.1f} %"
        rows.append(Row(f"reached / missed, {name}", f"{hit} / {missed}, {share} %", here, note))
    others = f"{100 * found.held_before:.1f} % -> {100 * found.held_after:.1f} %"
    rows.append(Row("of as many other poses", "-", others, "not seen by the search"))
    return Outcome(rows, found.figures(), lambda figure: draw(figure, found), (10.0, 5.0))
