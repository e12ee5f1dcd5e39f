"""What the log keeps of a tick of a machine that renders a twin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...control.chain_twin import ChainTwin
from ...control.force_control import ForceControl
from ...models import Array
from ...runtime.core.machine import LevelSpec
from .rendering import Rendering
from .sections import Twin
from .twin import SIX, degrees_of_freedom, joint_labels

Field = tuple[str, str | list[tuple[str, str]]] | tuple[str, str, int | tuple[int, ...]]

FELT: list[Field] = [
    ("wrench", "<f8", 6),  # of the operator, at the handle in B [N, N m]
    ("twin_position", "<f8", 3),
    ("twin_rotation", "<f8", (3, 3)),
    ("twin_twist", "<f8", 6),
    ("coupling", "<f8", 6),  # from handle to twin: translation [m] and rotation vector [rad] in B
]
"""What the operator does, and the twin."""


def twin_fields(twins: Mapping[str, Twin]) -> list[Field]:
    """The last numbers of a state: FELT, joints by their labels [rad or m, s], how far forces are faded in.

    Joints of twins that are not rendered have no value; the share is there where there are several twins.
    """
    joints = joint_labels(twins)
    of_chains: list[Field] = [(key, [(name, "<f8") for name in joints]) for key in ("twin", "twin_rate")]
    share: list[Field] = [("twin_share", "<f8")]
    return [*FELT, *(of_chains if joints else []), *(share if len(twins) > 1 else [])]


def motion(m: int) -> list[Field]:
    """Numbers of the commanded motion of m joints [rad or m, s]."""
    return [("q", "<f8", m), ("qd", "<f8", m), ("qdd", "<f8", m)]


def heated(m: int) -> list[Field]:
    """Shares that are used up of the times for which m motors may give more than for ever."""
    return [("heat", "<f8", m)] if m else []


def estimated(m: int) -> list[Field]:
    """Speeds and accelerations of m links as they are estimated [rad/s, rad/s^2]."""
    return [("link_rate", "<f8", m), ("link_acceleration", "<f8", m)] if m else []


def given_way(m: int) -> list[Field]:
    """Torques of m joints that nothing explains, and what of them they give way to."""
    return [("external", "<f8", m), ("excess", "<f8", m)] if m else []


def felt_beside(control: ForceControl) -> tuple[Array, ...]:
    """The arrays of ``given_way``; none where nothing gives way."""
    return (control.compliance.external, control.compliance.excess) if control.compliance else ()


def watched(passivity: bool) -> list[Field]:
    """Damping of translation and rotation that keeps a handle passive, where it is watched."""
    return [("damping", "<f8", 2)] if passivity else []  # [N s/m], [N m s/rad]


def solved(
    m: int, machine: int, levels: int, twins: Mapping[str, Twin], coupled: tuple[int, ...] = SIX
) -> list[Field]:
    """What follows after all numbers: m motors, limits of levels 2 to 8, levels, locks, the twin that it is.

    The limits are those of the twin, as many as the largest has, and so many of the machine.
    """
    joints, most = joint_labels(twins), max(degrees_of_freedom(twin, coupled) for twin in twins.values())
    held: list[Field] = [("held", "u1", len(joints))] if joints else []
    if len(twins) > 1:
        held.append(("rendered", [(name, "u1") for name in twins]))
    flags: list[Field] = [("spent", "u1", m), ("active", "u1", most + machine)]
    solver: list[Field] = [
        *(("status", "i1"), ("iterations", "<u2"), ("solves", "u1"), ("levels_done", "u1")),
        ("slack", "<f8", levels),  # of each level, see ``ForceControl.write_slack``
    ]
    return [*flags, *solver, *held]


def levels_of(control: ForceControl) -> tuple[LevelSpec, ...]:
    """The levels that are logged."""
    return tuple(LevelSpec(*level) for level in control.outline())


def felt(rendering: Rendering) -> tuple[Array, ...]:
    """The arrays of ``watched`` and FELT, in their order, as long as the same twin is rendered."""
    twin, control = rendering.control.twin, rendering.control
    return (
        *((rendering.passivity.damping,) if rendering.passivity else ()),
        *(rendering.wrench, twin.position, twin.rotation.reshape(-1), twin.twist),
        control.coupling_error,
    )


class Joints:
    """Joints of all twins side by side, and what locks do to them; those not rendered have no value."""

    def __init__(self, twins: Sequence[object]) -> None:
        counts = [len(twin.q) if isinstance(twin, ChainTwin) else 0 for twin in twins]
        self._twins = twins
        self._places = [slice(sum(counts[:i]), sum(counts[: i + 1])) for i in range(len(counts))]
        self.q, self.qd = np.full(sum(counts), np.nan), np.full(sum(counts), np.nan)
        self.held = np.zeros(sum(counts), np.uint8)

    def take(self, rendered: int) -> None:
        """Those of this tick."""
        self.q[:] = self.qd[:] = np.nan
        self.held[:] = 0
        twin, place = self._twins[rendered], self._places[rendered]
        if isinstance(twin, ChainTwin):
            self.q[place], self.qd[place] = twin.q, twin.qd
            if twin.held is not None:
                self.held[place] = twin.held


class StateLog:
    """Copies the numbers of a tick in one go, and what the solver says beside them."""

    def __init__(self, state: NDArray[np.void], numbers: Sequence[Array], rendering: Rendering) -> None:
        """The (1,) of a state that begins with these numbers, each (k,), and those of ``felt``."""
        self._own, self._rendering = numbers, rendering
        self._control = control = rendering.control
        self._joints = Joints(control.twins)
        self._gather()
        count = sum(len(each) for each in self._numbers)
        self._logged = state.view(np.uint8)[: 8 * count].view(np.float64)
        self._spent, self._active = state["spent"][0], state["active"][0]
        self._most = len(self._active) - len(control.active) + control.twin.limits.n
        names = state.dtype.names or ()
        self._held = state["held"][0] if "held" in names else None
        rendered = state["rendered"] if "rendered" in names else None
        self._named = [] if rendered is None else [rendered[name] for name in rendered.dtype.names or ()]
        self._status, self._iterations, self._solves, self._done = (
            state[name] for name in ("status", "iterations", "solves", "levels_done")
        )
        self._slack = np.zeros(state["slack"].shape[1])
        self._logged_slack = state["slack"][0]

    def _gather(self) -> None:
        """The arrays of the twin that is rendered."""
        control = self._control
        self._rendered = control.rendered
        share = (control.share,) if len(control.twins) > 1 else ()
        self._numbers = (*self._own, *felt(self._rendering), self._joints.q, self._joints.qd, *share)

    def fill(self) -> None:
        """Copy the state of this tick."""
        control = self._control
        if control.rendered != self._rendered:
            self._gather()
        self._joints.take(control.rendered)
        np.concatenate(self._numbers, out=self._logged)
        self._spent[:] = control.spent
        n, most, active = control.twin.limits.n, self._most, control.active
        self._active[:n], self._active[n:most], self._active[most:] = active[:n], 0, active[n:]
        if self._held is not None:
            self._held[:] = self._joints.held
        for i, named in enumerate(self._named):
            named[0] = i == control.rendered
        self._status[0] = control.solution.status
        self._iterations[0], self._solves[0] = control.iterations, control.solves
        self._done[0] = control.solution.levels_done
        control.write_slack(self._slack)  # the log's own are not aligned
        self._logged_slack[:] = self._slack
