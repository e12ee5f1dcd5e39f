"""Hands that lead an avatar where no station does: they go their way, and give way to what it feels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import pinocchio as pin

from ..devices.remote import ENGAGED, packed
from ..link.port import Received
from ..models import Array
from .fingers import CLOSED
from .gateway import AVATAR_SAYS, GLOVE_SAYS, OPERATOR_SAYS, PILOT_SAYS
from .hand import MOST_PUSH_N, PUSH_N, Grip, Path

GIVES_W = 5.0
"""Power that a palm puts into the link: nothing here feels what the avatar's motion costs, and without energy
of its leader it would stay behind [W]."""


class Script(Protocol):
    """What a person wants."""

    def at(self, time: float) -> Sequence[float]:
        """The numbers of a time [s]."""


class LeadingHands:
    """The far end of an avatar's link, as a ``hapticd.link.port.Port`` sees it.

    A hand without mass, a spring and a damper from its way: x' = K / D (F / K - x), |F| <= its strength.
    """

    def __init__(
        self,
        ways: Sequence[Path],
        grip: Grip,
        dt: float,
        fingers: Script | None = None,
        body: tuple[Script, Script] | None = None,
    ) -> None:
        """Lead from now on.

        Args:
            ways: of the palms: 3 places, 3 of a rotation vector.
            grip: what holds them to it.
            dt: period [s].
            fingers: how far those of each hand are closed, 0 to 1; None: the avatar has no hands.
            body: position and rotation vector of the head, and axes of the foot paddle; None: it has neither.
        """
        self._fingers, self._body = fingers, body
        self._ways, self._grip, self._dt = ways, grip, dt
        self._given = np.zeros((len(ways), 3))
        self._own: Array | None = None
        self._time = 0.0
        self._felt = np.zeros(len(ways), AVATAR_SAYS)

    def take(self) -> None:
        """A person leads from now on: the palms are to stay where they are wanted now."""
        if self._own is None:
            self._own = np.array([way.at(self._time)[0] for way in self._ways])

    def push(self, direction: Sequence[float]) -> None:
        """Once taken, both palms go a little further in a direction (3,)."""
        if self._own is not None:
            step = min(PUSH_N, MOST_PUSH_N) / self._grip.stiffness[0]
            self._own[:, :3] += step * np.array(direction)

    def lead(self, place: Sequence[float]) -> None:
        """Once taken, both palms go so far that the middle between them is at a place (3,) [m]."""
        if self._own is not None:
            self._own[:, :3] += np.array(place) - self._own[:, :3].mean(axis=0)

    def send(self, payload: bytes) -> None:
        """What the avatar's palms feel."""
        self._felt = np.frombuffer(payload, AVATAR_SAYS, len(self._ways))

    def receive(self) -> Received:
        """Where they are to be after another period."""
        self._time += self._dt
        said = np.zeros(len(self._ways), OPERATOR_SAYS)
        for i, way in enumerate(self._ways):
            value, rate = way.at(self._time)
            if self._own is not None:
                value, rate = self._own[i].tolist(), [0.0] * 6
            rotation = pin.exp3(np.array(value[3:]))
            self._yield(i, rotation)
            said[i]["pose"][:3] = np.array(value[:3]) + self._given[i]
            said[i]["pose"][3:] = pin.Quaternion(rotation).coeffs()
            said[i]["twist"][:3] = rate[:3]
            said[i]["flags"] = packed(ENGAGED, 1)
            said[i]["energy"] = GIVES_W * self._time
        return Received(said.tobytes() + self._gloves() + self._head_and_foot(), 0.0)

    def _head_and_foot(self) -> bytes:
        if self._body is None:
            return b""
        head, paddle = (script.at(self._time) for script in self._body)
        said = np.zeros(1, PILOT_SAYS)
        said["head"] = [*head[:3], *pin.Quaternion(pin.exp3(np.array(head[3:]))).coeffs()]
        said["paddle"], said["flags"] = paddle, packed(ENGAGED, 1)
        return said.tobytes()

    def _gloves(self) -> bytes:
        if self._fingers is None:
            return b""
        closed = self._fingers.at(self._time)
        said = np.zeros(len(closed), GLOVE_SAYS)
        said["angle"] = np.reshape(closed, (-1, 1)) * CLOSED.reshape(-1)
        said["flags"] = ENGAGED
        return said.tobytes()

    def _yield(self, i: int, rotation: Array) -> None:
        stiffness, damping = self._grip.stiffness[0], self._grip.damping[0]
        force = rotation @ self._felt[i]["wrench"][:3].astype(float)
        size = float(np.linalg.norm(force))
        force *= min(1.0, self._grip.strength[0] / max(size, 1e-9))
        share = min(1.0, self._dt * stiffness / damping)
        self._given[i] += share * (force / stiffness - self._given[i])
