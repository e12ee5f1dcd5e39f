"""One digital twin fades out, comes to rest, and gives its place to another, which fades in.

What acts on the twin that goes, M qdd = f, is taken to s f - c M qd with s(t) = e^(-(t / T)^2 / 2) and
c = -s' / s = t / T^2. Without forces its speed then follows s, and so does the kinetic energy that a hand can
feel of it, that of a mass M / s: a constant inertia gives the hand nothing that was not in it. At the start
there is no force and no acceleration that was not there before; at the end the other twin begins at rest,
where the one before has come to rest within ``REST``. Its own s rises in a straight line, which only takes
energy.
"""

from __future__ import annotations

from math import exp

from .force_control import ForceControl

FADE_OUT_S = 0.15
"""T: half a metre per second is brought to rest within 2 m/s^2 in about half a second."""
FADED = 1e-3
"""Share of its forces with which a twin may go: the acceleration that is left is that part of its limits."""
REST = 1e-3, 5e-3
"""Speeds that are rest to a twin [m/s], [rad/s]."""
PATIENCE_S = 2.0
"""A twin that is not at rest after so long is moved by something that no fade reaches."""


class TwinExchange:
    """Exchanges the twin of a force control while it is rendered.

    Attributes:
        wanted: index of the twin that is faded to; -1 for none.
        abandoned: why a fade was given up, for people; "" where none was.
    """

    def __init__(self, control: ForceControl, fade_in: float, dt: float) -> None:
        """``fade_in``: how long the forces of a new twin take [s], at ticks of dt [s]."""
        self._control, self._dt = control, dt
        self._step = dt / fade_in
        self.wanted, self.abandoned = -1, ""
        self._elapsed, self._from = 0.0, 1.0

    def reset(self) -> None:
        """The machine engages: a twin is there as a whole."""
        self.wanted = -1
        self._control.share[0], self._control.slowing = 1.0, 0.0

    def begin(self, index: int) -> None:
        """Fade to another twin."""
        self.wanted, self._elapsed, self._from = index, 0.0, float(self._control.share[0])

    def give_up(self, why: str) -> None:
        """The twin that is rendered stays; it fades in again where it was fading out."""
        if self.wanted >= 0:
            self.wanted, self.abandoned, self._control.slowing = -1, why, 0.0

    def update(self) -> None:
        """One tick, before the twin of this tick is prepared."""
        if self.wanted >= 0:
            self._fade_out()
        elif self._control.share[0] < 1.0:
            self._control.share[0] = min(1.0, self._control.share[0] + self._step)

    def _fade_out(self) -> None:
        control = self._control
        self._elapsed += self._dt
        t = self._elapsed / FADE_OUT_S
        control.share[0], control.slowing = self._from * exp(-0.5 * t * t), t / FADE_OUT_S
        if control.share[0] <= FADED and self._at_rest():
            control.exchange(self.wanted)
            self.wanted, control.share[0], control.slowing = -1, 0.0, 0.0
        elif self._elapsed > PATIENCE_S:
            self.give_up("the one that is rendered does not come to rest")

    def _at_rest(self) -> bool:
        speeds = [abs(speed) for speed in self._control.twin.twist.tolist()]
        return bool(max(speeds[:3]) <= REST[0] and max(speeds[3:]) <= REST[1])
