"""Inertia and friction that a hand feels at the handle of a simulated machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ..models import Array
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.system import Pushed, find_system
from ..runtime.live.lockstep import unswept
from .apparent import Apparent, UnexcitedError, apparent
from .own_plant import Doubt
from .pushes import TRIALS, Line, Pusher
from .recorded_joints import IdentifyError

AXES = "xyz"
"""Directions of the base."""


@dataclass(frozen=True, slots=True)
class Told:
    """What the pushes through a point along a direction told.

    Attributes:
        state: of the machine; along: direction of the base; at: the point (3,) [m].
        seen: what was identified; refused: or why nothing was.
    """

    state: str
    along: str
    at: Array
    seen: Apparent | None
    refused: str | None


def states(loaded: Loaded) -> Sequence[Pushed[Any]]:
    """In which a machine is pushed."""
    system = find_system(str(type(loaded.config).__struct_config__.tag))
    return system.pushed(loaded.config) if system.pushed else [Pushed()]


def push(
    loaded: Loaded,
    along: Sequence[str],
    at: Sequence[float] | None,
    doubt: Doubt,
    seed: int,
    progress: Callable[[float, str], None] = lambda *_: None,
) -> list[Told]:
    """Push the handle of a simulated machine, started anew for each state and direction.

    Args:
        loaded: its configuration.
        along: directions of the base; those that the handle moves in if there are none.
        at: point in the base frame [m]; None for where the hand begins.
        doubt: how the machine differs from what its controller believes.
        seed: of what is doubted.
        progress: told the share that is done, and what happens.

    Raises:
        ConfigError: the configuration does not fit together.
        IdentifyError: the machine has not one handle, does not start, or does not move so.
    """
    wanted = [(state, each) for state in states(loaded) for each in along or state.directions]
    for state, each in wanted:
        if each not in state.directions:
            moves = ", ".join(state.directions)
            raise IdentifyError(f"--along {each}: the handle of this machine moves along {moves}")
    told = []
    for k, (state, each) in enumerate(wanted):

        def share(part: float, k: int = k, what: str = f"{state.name}, along {each}") -> None:
            progress((k + part) / len(wanted), what)

        share(0.0)
        with unswept():
            told.append(_push(loaded, state, each, at, doubt, seed, share))
    return told


def _push(
    loaded: Loaded,
    state: Pushed[Any],
    along: str,
    at: Sequence[float] | None,
    doubt: Doubt,
    seed: int,
    progress: Callable[[float], None],
) -> Told:
    pusher = Pusher(loaded, state, doubt, seed)
    point = pusher.position.copy() if at is None else np.array(at)
    try:
        pushes = pusher.trials(Line(point, np.eye(3)[AXES.index(along)]), progress)
        return Told(state.name, along, point, apparent(pushes, 0.0, pusher.rate), None)
    except (UnexcitedError, IdentifyError) as error:
        return Told(state.name, along, point, None, str(error))


def table(told: Sequence[Told]) -> list[str]:
    """For people: some lines for each state and direction."""
    lines = [f"{TRIALS} forces each way; inertia and viscous friction of the handle, as a hand feels them"]
    for each in told:
        place = " ".join(f"{value:g}" for value in each.at.round(4).tolist())
        lines.append(f"{each.state}, along {each.along} through {place} m")
        if each.seen is None:
            lines.append(f"  not identified: {each.refused}")
            continue
        seen = each.seen
        for name, estimate, unit in (
            ("inertia", seen.inertia, "kg"),
            ("friction", seen.friction, "N s/m"),
            ("change", seen.change, "kg/m (of the inertia along the way)"),
        ):
            lines.append(f"  {name:10}{estimate.value:10.4g} +- {estimate.error:<8.2g} {unit}")
        lines.append(
            f"  left over: {seen.residual:.2g} N (standard deviation); {seen.samples.shape[1]} samples,"
            f" condition number {seen.condition:.0f}"
        )
    return lines


def as_json(told: Sequence[Told]) -> str:
    """The same as one JSON object."""
    rows = []
    for each in told:
        row: dict[str, Any] = {"state": each.state, "along": each.along, "at": each.at.tolist()}
        if (seen := each.seen) is not None:
            row |= {"inertia": seen.inertia, "friction": seen.friction, "change": seen.change}
            row |= {"residual": seen.residual, "condition": seen.condition}
            row |= {"samples": seen.samples.shape[1]}
        rows.append(row | {"refused": each.refused})
    return msgspec.json.encode({"handle": rows}, enc_hook=float).decode()


def draw(path: Path, told: Sequence[Told]) -> None:
    """Of each direction the force that inertia takes over acceleration, and friction's over speed.

    Raises:
        IdentifyError: the file cannot be written.
    """
    from matplotlib.figure import Figure

    seen = [(each, each.seen) for each in told if each.seen is not None]
    figure = Figure(figsize=(8.0, 2.2 * max(1, len(seen))), layout="constrained")
    axes = figure.subplots(max(1, len(seen)), 2, squeeze=False)
    for (each, found), (heavy, rubs) in zip(seen, axes, strict=False):
        a, v, _, left = found.samples
        for panel, x, slope, unit in (
            (heavy, a, found.inertia.value, "kg"),
            (rubs, v, found.friction.value, "N s/m"),
        ):
            panel.plot(x, slope * x + left, ".", markersize=2)
            ends = np.array([x.min(), x.max()])
            panel.plot(ends, slope * ends, label=f"{slope:.3g} {unit}")
            panel.legend(fontsize=8)
        heavy.set_ylabel(f"{each.state}, {each.along}\nforce [N]", fontsize=8)
    axes[-1, 0].set_xlabel("acceleration [m/s$^2$]; the rest of the fit taken off")
    axes[-1, 1].set_xlabel("speed [m/s]; the rest of the fit taken off")
    try:
        figure.savefig(path)
    except OSError as error:
        raise IdentifyError(f"cannot write {path}: {error.strerror}") from error
