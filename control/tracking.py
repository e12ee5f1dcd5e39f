"""Joint tracking of series-elastic drives with full feedforward (HapticGiant, section VI-E)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..binding import bind, pointer
from ..models import Array, Robot
from ._kernels import ffi, lib
from .ability import Ability
from .serial import SerialChain

SETTLED = 20
"""Ticks after a start until what loads a spring has a rate that means anything."""

SLOW = 0.002
"""Part of a joint's top speed at which most of its dry friction is fed forward: a sharper step shakes the
spring where more is believed than there is, a wider one leaves slow motion to the feedback."""


@dataclass(frozen=True, slots=True)
class SeriesElasticity:
    """One entry a joint: rotor inertia [kg m^2] in joint units, stiffness of the spring [N m/rad]."""

    rotor: Array
    stiffness: Array


@dataclass(frozen=True, slots=True)
class DriveFriction:
    """Friction of drives beyond the viscous one of the model, one entry a joint; slides have N, N s/m, m/s.

    Attributes:
        gear: dry, before the spring [N m]; damping: viscous, there [N m s/rad].
        share: of the torque in the spring, by which a gear rubs besides.
        bearing: dry, behind the spring [N m].
        slow: commanded speed at which 0.7 of the dry friction is fed forward [rad/s].
    """

    gear: Array
    damping: Array
    share: Array
    bearing: Array
    slow: Array


@dataclass(frozen=True, slots=True)
class Admitted:
    """What the gate lets through to a joint's drive, one entry a joint.

    Attributes:
        torque: [N m or N]; power: torque times measured speed [W].
        lower, upper: measured links beyond which no torque leads further out [rad or m].
    """

    torque: Array
    power: Array
    lower: Array
    upper: Array


class Tracking:
    """Torques that make the links follow the commanded state.

    Feedforward of the link side (gravity, inertia, the operator's wrench, friction) gives the spring torque;
    the spring's deflection under it moves the reference of a motor-side PD controller. What
    the deflection's rate and acceleration ask of the motor is fed forward, too (a series-elastic joint is
    flat), from the spring torque behind a low-pass of 7 ms in all; it is foretold by 2 ms. So is the friction
    of the gear, viscous, dry, and in proportion to its load, in the direction of the commanded speed.
    The measured motor state is one tick old, so it is compared with the reference of that tick: what it adds
    is known before the acceleration of the tick is chosen.
    """

    def __init__(
        self,
        manipulator: Robot,
        chain: SerialChain,
        elasticity: SeriesElasticity,
        friction: DriveFriction,
        proportional: Array,
        derivative: Array,
        admitted: Admitted,
        ability: Ability,
        inputs: Mapping[str, Array],
        dt: float,
    ) -> None:
        """Bind to the arrays of others that are read where they are.

        Args:
            manipulator: model of the links.
            chain: the same for the tick.
            elasticity: of its joints.
            friction: of its drives.
            proportional: motor-side gains, (6,) [N m/rad].
            derivative: motor-side gains, (6,) [N m s/rad].
            admitted: to the drives.
            ability: filled by ``forecast``.
            inputs: ``q, qd, qdd`` commanded link state, (6,); ``J`` of the handle, (6, 6); ``wrench`` of the
                operator on it in B, (6,) [N, N m]; ``motor, motor_rate, link`` measured, (6,)
                [rad, rad/s]; ``sensed``: torque between motor and link, (6,) [N m], of rigid joints.
            dt: of a tick [s].
        """
        n = manipulator.nv
        self._rigid, self.torque = np.zeros(n), np.zeros(n)
        still = manipulator.model.gravity.linear.tolist()
        self._chain = chain  # lives as long as what points to it
        self._core = ffi.new("tracking *", {"n": n, "dt": dt, "chain": chain.pointer, "still": still})
        bind(
            lib,
            self._core,
            friction=manipulator.damping,
            gear=friction.gear,
            gear_damping=friction.damping,
            load_share=friction.share,
            bearing=friction.bearing,
            slow=friction.slow,
            rotor=elasticity.rotor,
            stiffness=elasticity.stiffness,
            p=proportional,
            d=derivative,
            rigid=self._rigid,
            torque=self.torque,
            reference=np.zeros(n),
            rate=np.zeros(n),
            smoothed=np.zeros((n, 3)),
            slope=np.zeros(n),
            curve=np.zeros(n),
            shown=np.zeros(n),
            most_torque=admitted.torque,
            most_power=admitted.power,
            lower=admitted.lower,
            upper=admitted.upper,
            inertia=ability.inertia,
            load=ability.load,
            feedback=ability.feedback,
            strain=ability.strain,
            least=ability.least,
            most=ability.most,
            **inputs,
        )
        self._base: Array | None = None
        self._base_pointer: object = None
        self._fresh, self._planned, self._ticks = True, False, 0

    def doubt(self, doubted: bool) -> None:
        """Whether no more of the wrench is believed than springs, or torque sensors, show of it."""
        self._core.doubted = doubted

    @property
    def contradicted(self) -> bool:
        """Whether a joint shows less of the wrench than it should."""
        return bool(lib.tracking_contradicted(self._core))

    def reset(self) -> None:
        """Forget the reference of the last tick."""
        self._fresh, self._ticks = True, 0

    def forecast(self, qdd_ppu: Array, planned: bool = True) -> None:
        """Fill the ability for the commanded state, before the acceleration of this tick is known.

        Args:
            qdd_ppu: acceleration of the PPU, (2,) [m/s^2]; a base that only translates acts like gravity.
            planned: whether the torque that is left may serve the springs' yielding.
        """
        if qdd_ppu is not self._base:
            self._carry(qdd_ppu)
        lib.tracking_forecast(self._core, self._base_pointer, self._fresh)
        self._planned = planned

    def update(self, qdd_ppu: Array) -> Array:
        """Motor torques (6,) [N m]; own buffer.

        Args:
            qdd_ppu: acceleration of the PPU, (2,) [m/s^2].
        """
        if qdd_ppu is not self._base:
            self._carry(qdd_ppu)
        self._ticks += 1
        planned = self._planned and self._ticks > SETTLED
        lib.tracking_update(self._core, self._base_pointer, self._fresh, planned)
        self._fresh = self._planned = False
        return self.torque

    def _carry(self, qdd_ppu: Array) -> None:
        """Bound once: it always comes in the same array."""
        self._base, self._base_pointer = qdd_ppu, pointer(qdd_ppu, "const double", 2, name="qdd_ppu")
