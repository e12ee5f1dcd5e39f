"""What people see of a session of a machine that renders a twin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot, isfinite

import numpy as np

from ...control.chain import FREE
from ...runtime.core.machine import FigureSpec
from ...runtime.core.modes import Mode
from ...safety.heat import PLANNED
from ..telemanipulation.figures import STANDINGS, WORDS

NO_MORE = 0.99
"""Share of the planned part of a peak's time at which nothing of the peak is left."""


class RenderingFigures:
    """Work of the solver, and how far handle and twin are apart; see ``MachineFigures``."""

    specs: tuple[FigureSpec, ...] = (
        FigureSpec("HQP iterations", ""),
        FigureSpec("HQP solves", ""),
        FigureSpec("handle to twin", "mm"),
        FigureSpec("handle to twin, turned", "mrad"),
    )

    def __init__(self, units: Sequence[str]) -> None:
        """Units of the joints of chains that are twins, in the order of the state."""
        self._units = units

    def values(self, state: np.void) -> list[float]:
        """The figures of one record of STATE."""
        error = state["coupling"].tolist()
        apart = 1e3 * hypot(*error[:3]), 1e3 * hypot(*error[3:])
        return [float(state["iterations"]), float(state["solves"]), *apart]

    def live(self, mode: Mode, state: np.void) -> list[str]:
        """The operator's force, what yields, and where a chain's joints are, while they are moved.

        Which of several twins it is, always: at rest it can be exchanged, too.
        """
        if mode not in (Mode.ENGAGING, Mode.ACTIVE):
            return [f"twin {name}" for name in _chosen(state)]
        force = f"force {hypot(*state['wrench'][:3].tolist()):.0f} N"
        spent = [f"joint {i + 1} at its {_limit(state, i)}" for i in np.flatnonzero(state["spent"])[:1]]
        own = (*_led(state), *_damped(state), *_pushed(state))
        return [force, *own, *spent, *_rendered(state), *_chain(state, self._units)]


def _led(state: np.void) -> Iterator[str]:
    """What the twin has to do with the avatar's arm that it leads, and what the arm's palm feels of it."""
    if "standing" in (state.dtype.names or ()):
        word = "stopped" if state["stopped"] else WORDS[STANDINGS[int(state["standing"])]]
        yield f"avatar {word} {hypot(*state['felt'][:3].tolist()):.0f} N"


def _damped(state: np.void) -> Iterator[str]:
    """What keeps a handle passive, where it would not be."""
    if "damping" in (state.dtype.names or ()) and state["damping"].any():
        yield "damped by {:.3g} N s/m and {:.3g} N m s/rad".format(*state["damping"].tolist())


def _pushed(state: np.void) -> Iterator[str]:
    """The joint that gives way most, where one does."""
    if "excess" in (state.dtype.names or ()) and state["excess"].any():
        yield f"joint {int(np.abs(state['excess']).argmax()) + 1} gives way"


def _limit(state: np.void, i: int) -> str:
    """What the i-th motor gives all of: more than its rated torque while that lasts."""
    if "heat" not in (state.dtype.names or ()) or not (used := state["heat"][i] / PLANNED) < NO_MORE:
        return "rated torque"
    return f"peak torque, {100.0 * used:.0f} % of its time used"


def _rendered(state: np.void) -> Iterator[str]:
    """Which of several twins it is, and how far it has faded in."""
    for name in _chosen(state):
        share = float(state["twin_share"])
        yield f"twin {name}" + (f" at {100.0 * share:.0f} %" if share < 1.0 else "")


def _chosen(state: np.void) -> Iterator[str]:
    """Of several twins, the one that is rendered, or would be if the machine moved."""
    if "rendered" in (state.dtype.names or ()):
        flags = state["rendered"]
        yield from (name for name, flag in zip(flags.dtype.names, flags.item(), strict=True) if flag)


def _chain(state: np.void, units: Sequence[str]) -> Iterator[str]:
    """Joints of the twin by their names, and which of them a lock holds; a free mass has none."""
    if "twin" not in (state.dtype.names or ()):
        return
    twin = state["twin"]
    joints = zip(twin.dtype.names, units, twin.item(), state["held"].tolist(), strict=True)
    for name, unit, q, held in joints:
        if isfinite(q):
            yield f"{name.replace('_', ' ')} {q:z.2f} {unit}{' locked' if held != FREE else ''}"
