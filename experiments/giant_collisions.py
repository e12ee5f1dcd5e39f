"""Beyond the papers: what the collision look-ahead halts, and what not, of giant and Panda."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from math import inf
from typing import Any

import numpy as np

from ..runtime.configuration.config import load
from .collisions import AWAY, TOWARDS, Verdict, judge
from .outcome import Outcome, Progress, Row
from .workers import pool_of

TITLE = "random motions towards collisions, and past them"
MACHINES = ("giant", "panda")
COUNT = 24
"""Motions of each machine."""
MANY = 1000
"""Of a study: so many that come to a contact where nothing halts, and so many others."""
FIRST = 1000
"""The first seed; with smaller ones, margins were chosen."""
WORKERS = 2


def run(progress: Progress) -> Outcome:
    """Some motions of each machine."""
    found: dict[str, list[Verdict]] = {}
    for name in MACHINES:
        loaded, found[name] = load(name), []
        for i in range(COUNT):
            progress(f"{name}, motion {i + 1} of {COUNT}")
            found[name].append(judge(loaded, FIRST + i))
    return _outcome(found)


def study(progress: Progress) -> Outcome:
    """So many motions that there are MANY of both kinds."""
    return _outcome({name: list(_enough(name, progress)) for name in MACHINES})


def _enough(name: str, progress: Progress) -> Iterator[Verdict]:
    kinds: Counter[str] = Counter()
    seed, step = FIRST, 50 * WORKERS
    with pool_of(WORKERS) as pool:
        while min(_of(kinds, TOWARDS), _of(kinds, AWAY)) < MANY:
            for verdict in pool.map(partial(judge, load(name)), range(seed, seed + step)):
                kinds[verdict.kind] += 1
                yield verdict
            seed += step
            progress(f"{name}: {_of(kinds, TOWARDS)} motions to a contact, {_of(kinds, AWAY)} others")


def _of(kinds: Counter[str], which: Sequence[str]) -> int:
    return sum(kinds[kind] for kind in which)


def _outcome(found: dict[str, list[Verdict]]) -> Outcome:
    figures = {name: dict(Counter(verdict.kind for verdict in verdicts)) for name, verdicts in found.items()}
    rows = [row for name, verdicts in found.items() for row in _rows(name, verdicts)]

    def draw(figure: Any) -> None:
        (axes,) = figure.subplots(1, len(found), sharey=True, squeeze=False)
        for own, (name, verdicts) in zip(axes, found.items(), strict=True):
            halted = [(v.ahead.least, v.without.least) for v in verdicts if v.without]
            for label, least in zip(
                ("halted", "the same without"), np.array(halted).reshape(-1, 2).T, strict=True
            ):
                own.plot(range(1, len(least) + 1), 1e3 * np.sort(least), label=label)
            own.set(title=name, xlabel="motions that were halted [-]")
        axes[0].set_ylabel("least distance [mm]")
        axes[0].legend()

    return Outcome(rows, figures, draw)


def _rows(name: str, verdicts: Sequence[Verdict]) -> list[Row]:
    kinds = Counter(verdict.kind for verdict in verdicts)
    towards, others = _of(kinds, TOWARDS), _of(kinds, AWAY)
    least = min((v.ahead.least for v in verdicts if v.without), default=inf)
    margin = 1e3 * verdicts[0].margin
    return [
        Row(
            f"{name}: motions to a contact that are halted before it",
            "-",
            f"{kinds['halted']} of {towards}",
            f"nothing came nearer than {1e3 * least:.1f} mm under the pull of the hand; margin {margin:g} mm",
        ),
        Row(
            f"{name}: other motions that are halted",
            "-",
            f"{kinds['kept away'] + kinds['halted for nothing']} of {others}",
            f"{kinds['kept away']} of them would have passed something within the margin",
        ),
        Row(
            f"{name}: motions that are none of both",
            "-",
            f"{len(verdicts) - towards - others} of {len(verdicts)}",
            f"{kinds['never began']} in which the machine did not start, {kinds['other stop']} that"
            " something else stopped",
        ),
    ]
