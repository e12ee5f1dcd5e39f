"""The simulated hand of a twin's file: leads the joints of the twin to places at times."""

from __future__ import annotations

import itertools
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from math import pi
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from ...configs.quantities import AnyAngle, AnyLength, Instant
from ...configs.strict import Strict
from ...configs.units import Quantity, UnitError
from ...control.chain_twin import ChainTwin
from ...models import Array
from ...runtime.configuration.system import ScriptError
from . import sections as s
from .twin import chain_twin

STEP_S = 0.1
"""Between two places of the path that is written."""
LONGEST_S = 120.0
"""Of a script: the path is text in the configuration."""
STILL_S = 60.0
"""Without a script the hand stays where it is for so long."""
Angles = Callable[[Array], Sequence[float]]
"""Three angles of a handle's rotation (3, 3) [rad]."""


class Hand(Strict, frozen=True):
    """What the hand does: joints by their names at times, and when it lets go."""

    path: Annotated[tuple[dict[str, Any], ...], Meta(min_length=2, max_length=1000)]
    away: tuple[s.Away, ...] = ()


class Led:
    """Where the end of a chain is, and the angles that its machine gives a hand there.

    Angles that jump by a turn go on from the last ones instead.
    """

    _last: Array | None = None

    def __init__(self, twin: ChainTwin, handle: Array, angles: Angles) -> None:
        """The handle's pose (4, 4) at which the machine engages."""
        twin.reset(handle[:3, 3], handle[:3, :3])
        self._twin, self._angles = twin, angles

    def pose(self, q: Sequence[float] | Array) -> list[float]:
        """Position [m] and angles [rad], (6,), of the handle that the joints (n,) lead to."""
        twin = self._twin
        twin.q[:] = q
        twin.place()
        angles = np.array(self._angles(twin.rotation))
        if self._last is not None:
            angles -= 2.0 * pi * np.round((angles - self._last) / (2.0 * pi))
        self._last = angles
        return [*twin.position.tolist(), *angles.tolist()]


def path_of(section: s.Twin, hand: Mapping[str, Any], handle: Array, angles: Angles, key: str) -> str:
    """Tables of the path of a hand that does what a twin's file says.

    Args:
        section: the twin.
        hand: the table [hand] of its file; empty where the hand is to stay.
        handle: its pose (4, 4) at which the machine engages [m].
        angles: of its rotation.
        key: of the angles in a place of the machine's hand.

    Raises:
        ScriptError: what the table says cannot be done.
    """
    script = _read(hand) if hand else None
    if not isinstance(section, s.ChainTwin):
        raise ScriptError("hand", "leads joints, but a free mass has none", "remove it, and touches")
    if script is None:
        place = [*handle[:3, 3].tolist(), *angles(handle[:3, :3])]
        return "".join(_place(t, place, key) for t in (0.0, STILL_S))
    times, joints = _joints(script, section)
    led = Led(chain_twin(section), handle, angles)
    instants = np.arange(0.0, times[-1] + STEP_S / 2.0, STEP_S).tolist()
    tables = [_place(t, led.pose(_between(t, times, joints)), key) for t in instants]
    away = [
        f'[[simulation.hand.away]]\nat = "{pause.at:g} s"\nseconds = "{pause.seconds:g} s"\n'
        for pause in script.away
    ]
    return "\n".join([*tables, *away])


def _between(t: float, times: Sequence[float], joints: Array) -> Array:
    """Joints (n,) at a time: from place to place with the least jerk, at rest at each."""
    i = min(max(bisect_right(times, t) - 1, 0), len(times) - 2)
    s = min(max((t - times[i]) / (times[i + 1] - times[i]), 0.0), 1.0)
    way: Array = joints[i] + s**3 * (10.0 - 15.0 * s + 6.0 * s * s) * (joints[i + 1] - joints[i])
    return way


def _place(t: float, place: Sequence[float], key: str) -> str:
    position, angles = (" ".join(f"{x:.5f}" for x in part) for part in (place[:3], place[3:]))
    return f'[[simulation.hand.path]]\nat = "{t:.6g} s"\nposition = "{position} m"\n{key} = "{angles} rad"\n'


def _read(hand: Mapping[str, Any]) -> Hand:
    def quantity(kind: type, value: Any) -> Any:
        if issubclass(kind, Quantity):
            return kind.read(value)
        raise NotImplementedError(kind)

    try:
        return msgspec.convert(hand, Hand, dec_hook=quantity)
    except msgspec.ValidationError as error:
        raise ScriptError("hand", str(error), "give path, and away where the hand lets go") from error


def _joints(script: Hand, section: s.ChainTwin) -> tuple[list[float], Array]:
    """Times (k,) [s] and joints (k, n); what a place does not name stays as it was."""
    now = {name: float(joint.start) for name, joint in section.joints.items()}
    times: list[float] = []
    rows: list[list[float]] = []
    for i, place in enumerate(script.path):
        at = f"hand.path[{i}]"
        if "at" not in place:
            raise ScriptError(at, "has no time", 'write e.g. at = "4 s"')
        for name, value in place.items():
            if name != "at" and name not in section.joints:
                raise ScriptError(at, f"no joint '{name}'", f"known: {', '.join(section.joints)}")
            try:
                if name == "at":
                    times.append(float(Instant.read(value)))
                else:
                    now[name] = _one(value, section.joints[name])
            except UnitError as error:
                problem, _, fix = str(error).partition("; ")
                raise ScriptError(f"{at}.{name}", problem, fix) from error
        rows.append(list(now.values()))
    if any(after <= before for before, after in itertools.pairwise(times)):
        raise ScriptError("hand.path", "its times do not rise", "order the places by their time")
    if times[-1] > LONGEST_S:
        raise ScriptError("hand.path", f"lasts {times[-1]:g} s", f"give at most {LONGEST_S:g} s")
    return times, np.array(rows)


def _one(value: Any, joint: s.TwinJoint) -> float:
    return float((AnyAngle if isinstance(joint, s.RevoluteTwinJoint) else AnyLength).read(value))
