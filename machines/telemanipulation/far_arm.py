"""An avatar's arm as whoever leads it hears it: lease, stops, and what it feels, as it is given back."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ...control.lease import Fader, Granted, Lease
from ...control.link_passivity import EMPTY, OperatorPort
from ...control.notice import Notice
from ...devices.remote import BEHIND, ENGAGED, STOPPED, WAITING, unpacked
from ...devices.remote_avatar import RemoteAvatars
from ...models import Array
from .station import sane_wrench

RISE_S, FALL_S = 3.0, 50e-3
"""In which what the avatar feels fades in and out."""
SENSE = 4.0
"""Multiple of the largest wrench that is given back beyond which one that is heard makes no sense."""
DAMPS, QUIET_S = 1.0, 0.5
"""Damping by the link that is worth a word [N s/m], and when that is over [s]."""


class FarArm:
    """One arm of the avatar.

    Attributes:
        lease: of the near arm, or device, on this one.
        stopped: whether it says that it stopped itself.
        waits: whether it holds, for it hears nothing that it may follow.
        behind: whether the passivity of the link keeps it from where it is led.
        damped: whether that damps what is felt.
        passive: whether it acts at all.
        port: of this side of the link.
        fader: of what is felt.
        felt: what may be given back now, at the palm in its axes, (6,) [N, N m].
    """

    def __init__(
        self,
        name: str,
        lease: Lease,
        remote: RemoteAvatars,
        row: int,
        motion: tuple[Array, Array],
        felt: Array,
        most: tuple[float, float],
        feedback: float,
        passive: bool,
        dt: float,
    ) -> None:
        """Bind to a gateway and to what leads.

        Args:
            name: for people.
            lease: on the arm.
            remote: the gateways.
            row: of this arm's.
            motion: rotation of what leads it, (3, 3), and its twist in the same axes, (6,).
            felt: where to write it, (6,).
            most: largest force and torque that are given back [N, N m].
            feedback: gain of what is given back.
            passive: whether the energy of the link is bounded.
            dt: of a tick [s].
        """
        self.name, self.lease, self.felt, self.passive = name, lease, felt, passive
        self._remote, self._row, self._most, self._feedback = remote, row, most, feedback
        self._sense = tuple(SENSE * x for x in most)
        self.port, self._granted = OperatorPort(*motion, dt), Granted()
        self.fader = Fader(RISE_S, FALL_S, dt)
        self._damped = Notice(DAMPS, DAMPS, round(QUIET_S / dt))
        self._last = np.zeros(6)
        self.stopped = self.waits = self.behind = False

    @property
    def age(self) -> float:
        """Of what was heard last [s]."""
        return float(self._remote.age[self._row])

    @property
    def damped(self) -> bool:
        """See ``FarArm``."""
        return self._damped.on

    def hear(self, act: int) -> bool:
        """Take what came; whether a stop of the arm began or ended.

        Args:
            act: the person's last one here.
        """
        i, remote = self._row, self._remote
        wrench, age = remote.wrench[i].tolist(), float(remote.age[i])
        flags, _ = unpacked(int(remote.flags[i]))
        valid = sane_wrench(wrench, *self._sense)
        if self.lease.update(age, valid, bool(flags & ENGAGED), act):
            self._last[:] = wrench
            self.waits, self.behind = bool(flags & WAITING), bool(flags & BEHIND)
        stopped = valid and bool(flags & STOPPED)
        changed = stopped is not self.stopped
        self.stopped = stopped
        return changed

    def feel(self, share: float) -> bool:
        """Write a share of what it feels, as energy allows; whether the link has begun to damp it."""
        port = self.port
        push(self._feedback * self._last, share, self._most, port.wrench)
        if not self.passive:
            self.felt[:] = port.wrench
            return False
        if share == 0.0:  # nothing goes over the link
            port.reset()
            self._granted.begin()
        else:
            port.update(self._granted.update(float(self._remote.energy[self._row])))
        self.felt[:] = port.felt
        return self._damped.update(port.damping if port.why & EMPTY else 0.0)


def push(wrench: Array, share: float, largest: tuple[float, float], out: Array) -> None:
    """A share of a wrench (6,), of which force and torque are no more than the largest."""
    for half, most in zip((slice(0, 3), slice(3, 6)), largest, strict=True):
        part = wrench[half]
        size = sqrt(part.dot(part))
        np.multiply(part, share * min(1.0, most / max(size, most)), out=out[half])
