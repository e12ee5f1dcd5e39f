"""What the log keeps of a tick of a machine that renders a twin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...control.force_control import ForceControl
from ...models import Array
from .rendering import Rendering

Field = tuple[str, str] | tuple[str, str, int | tuple[int, ...]]


FELT: list[Field] = [
    ("wrench", "<f8", 6),  # of the operator, at the handle in B [N, N m]
    ("twin_position", "<f8", 3),
    ("twin_rotation", "<f8", (3, 3)),
    ("twin_twist", "<f8", 6),
    ("coupling", "<f8", 6),  # from handle to twin: translation [m] and rotation vector [rad] in B
]
"""The last numbers of a state: what the operator does, and the twin."""


def motion(m: int) -> list[Field]:
    """Numbers of the commanded motion of m joints [rad or m, s]."""
    return [("q", "<f8", m), ("qd", "<f8", m), ("qdd", "<f8", m)]


def solved(m: int, active: int) -> list[Field]:
    """What follows after all numbers, with m motors and so many limits of levels 2 to 8."""
    return [
        ("spent", "u1", m),
        ("active", "u1", active),
        ("status", "i1"),
        ("iterations", "<u2"),
        ("solves", "u1"),
    ]


def felt(rendering: Rendering) -> tuple[Array, ...]:
    """The arrays of FELT, in its order."""
    twin, control = rendering.control.twin, rendering.control
    return (
        *(rendering.wrench, twin.position, twin.rotation.reshape(-1), twin.twist),
        control.coupling_error,
    )


class StateLog:
    """Copies the numbers of a tick in one go, and what the solver says beside them."""

    def __init__(self, state: NDArray[np.void], numbers: Sequence[Array], control: ForceControl) -> None:
        """The (1,) of a state that begins with these numbers, each (k,)."""
        self._numbers, self._control = numbers, control
        count = sum(len(each) for each in numbers)
        self._logged = state.view(np.uint8)[: 8 * count].view(np.float64)
        self._flags = [(state[name][0], getattr(control, name)) for name in ("spent", "active")]
        self._status, self._iterations, self._solves = (
            state[name] for name in ("status", "iterations", "solves")
        )

    def fill(self) -> None:
        """Copy the state of this tick."""
        control = self._control
        np.concatenate(self._numbers, out=self._logged)
        for logged, flags in self._flags:
            logged[:] = flags
        self._status[0] = control.solution.status
        self._iterations[0], self._solves[0] = control.iterations, control.solves
