"""Passivity of the link of one pair of arms: an observer, a controller and a tank of energy on either side.

Each side sends ``sent`` with its packets and hands the newest that it got to ``update``. Neither needs to
know the delay. At the start there is ``begin`` in either tank: that, and what sampling and sensors are wrong
by, is all that the link can give out beyond what went in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..binding import bind
from ..models import Array
from ._kernels import ffi, lib
from .avatar_law import Impedance

EMPTY, DEBT = int(lib.PASSIVITY_EMPTY), int(lib.PASSIVITY_DEBT)
DRIFT, FILLS = int(lib.PASSIVITY_DRIFT), int(lib.PASSIVITY_FILLS)
"""Why a port intervenes: its tank is too empty for what was asked; it owes; the reference is not the command;
the tank fills from the operator's motion."""
FILL, HARVEST = 0.03, 6.0
"""Level below which the operator's motion is damped [J], and by how much at most [N s/m]."""


@dataclass(frozen=True, slots=True)
class Tank:
    """Constants of a tank.

    Attributes:
        begin: level at the start [J].
        keep: level up to which nothing is handed over to the other side [J].
        most: level at which it spills [J].
        rate: of what is given out, power by level [1/s].
        grant: of what is handed over [1/s].
        radius: at which a torque counts like a force [m].
    """

    begin: float = 0.03
    keep: float = 0.02
    most: float = 1.0
    rate: float = 20.0
    grant: float = 20.0
    radius: float = 0.1

    def __post_init__(self) -> None:
        positive = self.most, self.rate, self.grant, self.radius
        if not (min(positive) > 0.0 and 0.0 <= self.keep <= self.most and 0.0 <= self.begin <= self.most):
            raise ValueError(f"{self} wants begin and keep from 0 to most, the rest above 0")


OPERATOR_TANK = Tank()
AVATAR_TANK = Tank(keep=0.0025)
"""Found on random hands, walls and networks (experiments/contact_over_link.py). The operator's side keeps
more: with too little his hand sticks where it pressed too deep while the wall's answer was under way."""


class Port:
    """What both sides report, in the tick and since ``reset``."""

    _tank: Any

    @property
    def level(self) -> float:
        """Energy in the tank [J]; below 0: a debt."""
        return float(self._tank.level)

    @property
    def sent(self) -> float:
        """Handed over to the other side in all [J]; goes with every packet."""
        return float(self._tank.sent)

    @property
    def taken(self) -> float:
        """Work that the layer has kept from being done, in all [J]."""
        return float(self._tank.taken)

    @property
    def spilt(self) -> float:
        """Energy that found no room in the tank, in all [J]."""
        return float(self._tank.spilt)

    @property
    def damping(self) -> float:
        """Of this tick: [N s/m] at the operator's hand, [m/(N s)] at the avatar's reference; 0 for none."""
        return float(self._tank.damping)

    @property
    def why(self) -> int:
        """Of this tick: EMPTY, DEBT, DRIFT, FILLS; 0 where the layer does nothing."""
        return int(self._tank.why)


class OperatorPort(Port):
    """Renders the wrench that came from the avatar as far as energy allows.

    Attributes:
        wrench: as it came, at the palm in its axes, (6,) [N, N m]; write here.
        felt: what may be rendered, (6,).
    """

    def __init__(
        self, rotation: Array, twist: Array, dt: float, tank: Tank = OPERATOR_TANK, most_damping: float = 30.0
    ) -> None:
        """Bind to the operator's arm.

        Args:
            rotation: of its palm in the station, (3, 3).
            twist: of its palm in the station's axes, (6,).
            dt: of a tick [s].
            tank: constants.
            most_damping: with which a debt is collected [N s/m].
        """
        self.wrench, self.felt = np.zeros(6), np.zeros(6)
        self._core = ffi.new(
            "operator_port *",
            {
                "tank": _tank(tank, dt),
                "most_damping": most_damping,
                "fill": max(FILL, 1.5 * tank.keep),
                "harvest": HARVEST,
            },
        )
        self._tank = self._core.tank
        bind(
            lib,
            self._core,
            wrench=self.wrench,
            rotation=rotation,
            twist=twist,
            felt=self.felt,
        )
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        lib.operator_port_reset(self._core)

    def update(self, granted: float) -> None:
        """Compute what may be felt; granted: ``sent`` of the avatar's port, as it came last [J]."""
        lib.operator_port_update(self._core, granted)


class AvatarPort(Port):
    """Leads the avatar's reference to the command as far as energy allows.

    Attributes:
        position, rotation: commanded, (3,) [m] and (3, 3) in the station; write here.
        reference, reference_rotation: what the avatar's law is to follow.
        drift: command less reference, (6,) [m, rad].
    """

    def __init__(
        self,
        rotation: Array,
        twist: Array,
        felt: Array,
        impedance: Impedance,
        dt: float,
        tank: Tank = AVATAR_TANK,
    ) -> None:
        """Bind to the avatar's arm.

        Args:
            rotation: of its palm in the station, (3, 3).
            twist: of its palm in the station's axes, (6,).
            felt: wrench of the world on the palm in its axes, (6,) [N, N m].
            impedance: of the avatar's law.
            dt: of a tick [s].
            tank: constants.
        """
        k = impedance
        self.position, self.rotation = np.zeros(3), np.eye(3)
        self.reference, self.reference_rotation, self.drift = np.zeros(3), np.eye(3), np.zeros(6)
        self._core = ffi.new(
            "avatar_port *",
            {
                "tank": _tank(tank, dt),
                "stiffness": [k.stiffness] * 3 + [k.rotational_stiffness] * 3,
                "retreat": 0.05,
                "return_time": 0.3,
                "speed": 0.1,
                "turn": 0.5,
            },
        )
        self._tank = self._core.tank
        bind(
            lib,
            self._core,
            felt=felt,
            rotation=rotation,
            twist=twist,
            position=self.position,
            orientation=self.rotation,
            reference=self.reference,
            reference_rotation=self.reference_rotation,
            drift=self.drift,
        )

    def reset(self) -> None:
        """Begin anew, with the reference at the command."""
        lib.avatar_port_reset(self._core)

    def update(self, granted: float) -> None:
        """Advance the reference; granted: ``sent`` of the operator's port, as it came last [J]."""
        lib.avatar_port_update(self._core, granted)


def _tank(tank: Tank, dt: float) -> dict[str, float]:
    names = "begin", "keep", "most", "rate", "grant", "radius"
    return {"dt": dt, **{name: getattr(tank, name) for name in names}}
