"""Whether joints follow where they are led, and whether their motors can hold what is asked of them."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp

import numpy as np

from ..binding import bind, pointer
from ..models import Array
from ._kernels import ffi, lib
from .ability import Ability

DOUBT, DOUBT_S = 0.3, 0.5
"""Part of the torque that planned accelerations took which the model may get wrong, and for how long that
lasts: masses a fifth too light, on feedback that swings with some 2 Hz."""


class Following:
    """Watches the joints of an arm, each on a leash.

    What the model may get wrong of accelerations that were planned lately comes on top of leash and strain.

    Attributes:
        led: where they were led in the last tick, (m,) [rad or m].
        leash: how far each may be from there, (m,) [rad or m].
        astray: whether each is further away, or its motor was strained for too long; ``nowhere`` where all
            follow.
        nowhere: False for each.
        overload: name of the joint of whose motor more is asked than it has, now or lately; "" for none.
    """

    def __init__(
        self,
        names: Sequence[str],
        link: Array,
        leash: Array,
        most: Array,
        longest: int,
        ability: Ability,
        able: Array,
        lately: int,
        qdd: Array,
        gain: Array,
        dt: float,
    ) -> None:
        """Bind to arrays that are read where they are, (m,).

        Args:
            names: of the joints.
            link: measured [rad or m].
            leash: see above.
            most: what the feedback may give alone [N m or N].
            longest: ticks for which it may give more.
            ability: what it gives, the loads of the motors, and the inertia.
            able: what the motors may give now [N m or N].
            lately: ticks for which an overload is remembered.
            qdd: planned accelerations [rad/s^2 or m/s^2].
            gain: of the feedback from a joint's position [N m/rad or N/m].
            dt: period [s].
        """
        n = len(names)
        self._names, self._lately, self._since = names, lately, 0
        self.led, self.leash = np.zeros(n), leash
        self._strained, self._astray = np.zeros(n, np.intc), np.zeros(n, np.bool_)
        self.nowhere = self.astray = [False] * n
        self.overload = ""
        self._planned = np.zeros(n)
        doubts = {"doubt": DOUBT, "keep": exp(-dt / DOUBT_S)}
        self._core = ffi.new("following *", {"n": n, "longest": longest, **doubts})
        bind(
            lib,
            self._core,
            **{"link": link, "led": self.led, "most": most, "able": able},
            **{"strain": ability.strain, "load": ability.load},
            **{"inertia": ability.inertia, "qdd": qdd, "gain": gain, "planned": self._planned},
            **{"strained": self._strained, "astray": self._astray},
        )
        self._longer = np.zeros(n)
        self._leash, self._longer_leash = (
            pointer(array, "const double", n, name="leash") for array in (leash, self._longer)
        )

    def reset(self, q: Array) -> None:
        """The joints are where they are led, (m,) [rad or m]."""
        self.led[:] = q
        self._strained[:], self._planned[:] = 0, 0.0
        self.overload = ""

    def judge(self, leash: Array | None, strains: bool) -> None:
        """Look at the measured joints.

        Args:
            leash: of this tick, (m,) [rad or m]; None for the usual one.
            strains: whether what the feedback gives counts in this tick.
        """
        which = self._leash
        if leash is not None:
            self._longer[:], which = leash, self._longer_leash
        astray = lib.following_judge(self._core, which, strains)
        self.astray = self._astray.tolist() if astray else self.nowhere

    def weigh(self) -> None:
        """Look at the loads."""
        found = lib.following_overloaded(self._core)
        self._since += 1
        if found >= 0:
            self.overload, self._since = self._names[found], 0
        elif self._since > self._lately:
            self.overload = ""
