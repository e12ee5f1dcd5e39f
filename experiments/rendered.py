"""Lockstep sessions of the giant with a chain as its twin, watched tick by tick."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..control.chain import Gains
from ..control.force_control import Detection
from ..machines.giant.config import GiantConfig
from ..machines.giant.machine import Giant
from ..machines.giant.names import PPU_JOINTS
from ..machines.rendering.sections import ChainTwin
from ..machines.rendering.twin import limits_of, mechanism_of, robot_of
from ..models import Array
from ..models.dh_robot import END
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded, parse
from ..runtime.configuration.session import Session, build
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import Lockstep
from .consistency import Judge, Judgement
from .outcome import COLOURS, LINES

MOVED = (Mode.ENGAGING, Mode.ACTIVE)
"""Modes in which the twin is rendered."""


def with_rule(loaded: Loaded, rule: Detection) -> Loaded:
    """The same machine under a rule of how limits reach the twin."""
    text = re.sub(r'(?m)^detection = "\w+"', f'detection = "{rule}"', loaded.text)
    return replace(loaded, text=text, config=parse(text, loaded.source))


@dataclass(frozen=True, slots=True)
class Trace:
    """What became of the twin, over the k ticks in which it was rendered.

    Attributes:
        t: (k,) [s].
        q, qd: joints, (k, n) [rad or m, s].
        torque: of the user in the twin's joints, (k, n) [N m or N].
        lower, upper, velocity: limits of the joints, (n,).
        held: what locks did, (k, n).
        deviation: from the constrained multibody system, (k,); see ``Judgement``.
        tight: limits that were tight, (k,); same: whether those of the tick before, (k,).
        pulling: whether a limit pulled, (k,).
        stop: why the session stopped, "" where it did not.
    """

    t: Array
    q: Array
    qd: Array
    torque: Array
    lower: Array
    upper: Array
    velocity: Array
    held: NDArray[np.uint8]
    deviation: Array
    tight: NDArray[np.int64]
    same: NDArray[np.bool_]
    pulling: NDArray[np.bool_]
    stop: str

    def part(self, begin: float, end: float) -> Trace:
        """What lies between two times [s]."""
        chosen = (self.t >= begin) & (self.t < end)
        whole = ("lower", "upper", "velocity", "stop")
        names = [each.name for each in fields(self) if each.name not in whole]
        return replace(self, **{name: getattr(self, name)[chosen] for name in names})


class Watch:
    """Judges every tick of a giant's session that renders a chain."""

    def __init__(self, session: Session) -> None:
        machine, settings = session.cycle.machine, session.config
        assert isinstance(machine, Giant) and isinstance(settings, GiantConfig)
        section = settings.giant.twin
        assert isinstance(section, ChainTwin)
        control = machine.force_control
        robot, gains = robot_of(section), settings.giant.force_control
        self._machine, self._session, self._control = machine, session, control
        self._judge = Judge(
            control,
            session.robot.without(PPU_JOINTS),
            robot,
            section.end or END,
            mechanism_of(section, robot),
            section.gravity,
            Gains(gains.p_gain, gains.p_gain, gains.d_gain, gains.d_gain),
        )
        self.limits = limits_of(section, robot)
        self.judgements: list[Judgement] = []
        self._active: list[bytes] = []
        self._rows: list[tuple[Array, Array, Array, NDArray[np.uint8]]] = []
        self._times: list[float] = []
        self._moving, self._share = np.zeros(6), 1.0
        prepare, advance = control.prepare, control.advance

        def pulled(wrench: Array, share: float = 1.0) -> None:
            self._moving[:] = wrench  # not what is measured: foretold, and damped
            self._share = share
            prepare(wrench, share)

        def watched() -> None:
            if session.cycle.mode in MOVED:
                self._look()
            advance()

        control.prepare, control.advance = pulled, watched  # type: ignore[method-assign]

    def _look(self) -> None:
        control, felt = self._control, self._machine.felt
        twin = control.twin
        self.judgements.append(self._judge.judge(self._moving, self._share))
        self._active.append(control.active.tobytes())
        held = np.zeros(len(twin.q), np.uint8) if twin.held is None else twin.held.copy()
        self._rows.append((twin.q.copy(), twin.qd.copy(), felt @ twin.J, held))
        self._times.append(len(self._times) / self._session.config.loop.rate)

    def trace(self, begin: float, stop: str) -> Trace:
        """All that was seen, from a time on [s]."""
        q, qd, torque, held = (np.array(column) for column in zip(*self._rows, strict=True))
        lower, upper, velocity, _ = self.limits
        same = [False, *(a == b for a, b in zip(self._active, self._active[1:], strict=False))]
        return Trace(
            np.array(self._times) + begin,
            *(q, qd, torque, lower, upper, velocity, held),
            np.array([each.deviation for each in self.judgements]),
            np.array([each.tight for each in self.judgements]),
            np.array(same),
            np.array([each.pulling for each in self.judgements]),
            stop,
        )


def rendered(twin: str, rule: Detection, seconds: float, progress: Callable[[str], None]) -> Trace:
    """A session of the giant in lockstep with a built-in twin and its scripted hand."""
    loaded = with_rule(config.load(f"giant with {twin}"), rule)
    lockstep = Lockstep(build(loaded))
    watch, cycle = Watch(lockstep.session), lockstep.session.cycle
    rate, begin = loaded.config.loop.rate, 0.0
    for tick in range(round(seconds * rate)):
        lockstep.tick()
        if not watch.judgements:
            begin = (tick + 1) / rate
        if tick % 1000 == 0:
            progress(f"{tick / rate:.0f} of {seconds:g} s")
    trip = cycle.stops.last
    return watch.trace(begin, str(trip.verdict.detail) if trip else "")


def seen(times: Array, signs: Mapping[str, NDArray[np.bool_]]) -> dict[str, float | None]:
    """First of k times [s] of each sign, (k,), after that of the one before; None where there is none."""
    found: dict[str, float | None] = {}
    after = 0
    for name, sign in signs.items():
        later = np.flatnonzero(sign[after:])
        if not later.size:
            return {**found, **dict.fromkeys(list(signs)[len(found) :], None)}
        after += int(later[0])
        found[name] = float(times[after])
    return found


def excess(trace: Trace) -> float:
    """How far beyond its limits a joint of the twin went [rad or m]."""
    return float(max((trace.q - trace.upper).max(), (trace.lower - trace.q).max(), 0.0))


def consistency(trace: Trace) -> float:
    """Worst deviation over the ticks whose active limits are those of the tick before."""
    return float(trace.deviation[trace.same].max(initial=0.0))


DRAWN = 20
"""Of so many ticks one is drawn."""


def draw_trace(
    figure: Any,
    trace: Trace,
    names: Sequence[str],
    moments: Mapping[str, float | None],
    locked: NDArray[np.bool_] | None = None,
) -> None:
    """Joint angles with their limits, and the user's torques, as Figs. 8 and 9 have them.

    Args:
        figure: empty, of matplotlib.
        trace: of the session.
        names: of the joints.
        moments: marked in both plots.
        locked: ticks that are shaded, (k,).
    """
    angles, torques = figure.subplots(2, 1, sharex=True)
    t, q, torque = (values[::DRAWN] for values in (trace.t, trace.q, trace.torque))
    for i, (name, colour, line) in enumerate(zip(names, COLOURS, LINES, strict=False)):
        angles.plot(t, q[:, i], color=colour, ls=line, lw=1.2, label=name)
        for limit in (trace.lower[i], trace.upper[i]):
            angles.axhline(limit, color=colour, ls=":", lw=0.8)
        torques.plot(t, torque[:, i], color=colour, ls=line, lw=1.0, label=name)
    for axes in (angles, torques):
        for moment in moments.values():
            if moment is not None:
                axes.axvline(moment, color="black", lw=0.8)
        if locked is not None:
            shaded = axes.get_xaxis_transform()
            axes.fill_between(t, 0.0, 1.0, where=locked[::DRAWN], transform=shaded, color="0.9", lw=0.0)
    for name, moment in moments.items():
        if moment is not None:
            angles.annotate(
                f"${name}$", (moment, 1.02), xycoords=("data", "axes fraction"), ha="center", va="bottom"
            )
    angles.set(ylabel="angle of the twin's joint [rad]")
    torques.set(xlabel="time [s]", ylabel="user's torque in the joint [N m]")
    figure.legend(*angles.get_legend_handles_labels(), loc="outside lower center", ncols=len(names))
