"""What the log keeps of a tick of a machine that renders a twin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...control.chain_twin import ChainTwin
from ...control.force_control import ForceControl
from ...models import Array
from ...runtime.core.machine import LevelSpec
from .rendering import Rendering

Field = tuple[str, str | list[tuple[str, str]]] | tuple[str, str, int | tuple[int, ...]]

FELT: list[Field] = [
    ("wrench", "<f8", 6),  # of the operator, at the handle in B [N, N m]
    ("twin_position", "<f8", 3),
    ("twin_rotation", "<f8", (3, 3)),
    ("twin_twist", "<f8", 6),
    ("coupling", "<f8", 6),  # from handle to twin: translation [m] and rotation vector [rad] in B
]
"""What the operator does, and the twin."""


def twin_fields(joints: Sequence[str]) -> list[Field]:
    """The last numbers of a state: FELT, and of a chain its joints by their names [rad or m, s]."""
    if not joints:
        return FELT
    return [
        *FELT,
        ("twin", [(name, "<f8") for name in joints]),
        ("twin_rate", [(name, "<f8") for name in joints]),
    ]


def motion(m: int) -> list[Field]:
    """Numbers of the commanded motion of m joints [rad or m, s]."""
    return [("q", "<f8", m), ("qd", "<f8", m), ("qdd", "<f8", m)]


def heated(m: int) -> list[Field]:
    """Shares that are used up of the times for which m motors may give more than for ever."""
    return [("heat", "<f8", m)] if m else []


def given_way(m: int) -> list[Field]:
    """Torques of m joints that nothing explains, and what of them they give way to."""
    return [("external", "<f8", m), ("excess", "<f8", m)] if m else []


def felt_beside(control: ForceControl) -> tuple[Array, ...]:
    """The arrays of ``given_way``; none where nothing gives way."""
    return (control.compliance.external, control.compliance.excess) if control.compliance else ()


def watched(passivity: bool) -> list[Field]:
    """Damping of translation and rotation that keeps a handle passive, where it is watched."""
    return [("damping", "<f8", 2)] if passivity else []  # [N s/m], [N m s/rad]


def solved(m: int, active: int, levels: int, joints: Sequence[str] = ()) -> list[Field]:
    """What follows after all numbers: m motors, so many limits of levels 2 to 8, levels, a chain's locks."""
    held: list[Field] = [("held", "u1", len(joints))] if joints else []
    flags: list[Field] = [("spent", "u1", m), ("active", "u1", active)]
    solver: list[Field] = [
        *(("status", "i1"), ("iterations", "<u2"), ("solves", "u1"), ("levels_done", "u1")),
        ("slack", "<f8", levels),  # of each level, see ``ForceControl.write_slack``
    ]
    return [*flags, *solver, *held]


def levels_of(control: ForceControl) -> tuple[LevelSpec, ...]:
    """The levels that are logged."""
    return tuple(LevelSpec(*level) for level in control.outline())


def felt(rendering: Rendering) -> tuple[Array, ...]:
    """The arrays of ``watched`` and ``twin_fields``, in their order."""
    twin, control = rendering.control.twin, rendering.control
    return (
        *((rendering.passivity.damping,) if rendering.passivity else ()),
        *(rendering.wrench, twin.position, twin.rotation.reshape(-1), twin.twist),
        control.coupling_error,
        *((twin.q, twin.qd) if isinstance(twin, ChainTwin) else ()),
    )


class StateLog:
    """Copies the numbers of a tick in one go, and what the solver says beside them."""

    def __init__(self, state: NDArray[np.void], numbers: Sequence[Array], control: ForceControl) -> None:
        """The (1,) of a state that begins with these numbers, each (k,)."""
        self._numbers, self._control = numbers, control
        count = sum(len(each) for each in numbers)
        self._logged = state.view(np.uint8)[: 8 * count].view(np.float64)
        flags = [("spent", control.spent), ("active", control.active)]
        if control.twin.held is not None:
            flags.append(("held", control.twin.held))
        self._flags = [(state[name][0], array) for name, array in flags]
        self._status, self._iterations, self._solves, self._done = (
            state[name] for name in ("status", "iterations", "solves", "levels_done")
        )
        self._slack = np.zeros(state["slack"].shape[1])
        self._logged_slack = state["slack"][0]

    def fill(self) -> None:
        """Copy the state of this tick."""
        control = self._control
        np.concatenate(self._numbers, out=self._logged)
        for logged, flags in self._flags:
            logged[:] = flags
        self._status[0] = control.solution.status
        self._iterations[0], self._solves[0] = control.iterations, control.solves
        self._done[0] = control.solution.levels_done
        control.write_slack(self._slack)  # the log's own are not aligned
        self._logged_slack[:] = self._slack
