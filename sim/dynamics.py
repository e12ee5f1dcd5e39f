"""Dynamics of arms on a base whose motion is prescribed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from ..binding import bind
from ..models import Array, Robot
from ._plant import ffi, lib
from .friction import Braked, Friction
from .hold import Hold, chain
from .links import Links


@dataclass(frozen=True, slots=True)
class Work:
    """Done on an arm's joints since it was made [J]; what brakes, friction and dampers do is never positive.

    Attributes:
        motors: by their torques.
        hand: by its wrench, and by what else pushes.
        dry: by brakes and dry friction.
        damping: by viscous friction and the springs' damping.
    """

    motors: float
    hand: float
    dry: float
    damping: float


class HeldArm(ABC):
    """An arm of which a frame is held: viscous friction of the model, dry friction, and a hand's hold.

    The base only translates, so its acceleration is subtracted from gravity and nothing else changes.
    Integration is symplectic Euler with ``substeps`` steps a period; hold and dry friction are implicit.

    Attributes:
        q, qd, qdd: link side, (n,) [rad or m, s].
        motor, motor_rate: rotor side, in joint units, (n,).
        spring: torque that a sensor between rotor and link measures, (n,) [N m or N].
        hold: what the hand does to the frame.
        push: what else touches the links, as torques of the joints, (n,) [N m or N].
        position, rotation, twist, acceleration: of the frame in B without the base's motion, (3,), (3, 3),
            (6,), (6,).
    """

    motor: Array
    motor_rate: Array

    def __init__(self, robot: Robot, frame: str, armature: Array, substeps: int) -> None:
        """The frame by its name; armature: inertia of what turns with the links, (n,)."""
        self._robot = robot
        n = robot.nv
        self._substeps = substeps
        self._gravity = robot.model.gravity.linear.copy()
        self._links = links = Links(robot, frame, armature)
        self.q, self.qd, self.qdd = links.q, links.qd, links.qdd
        self.spring, self.push = np.zeros(n), np.zeros(n)
        self.position, self.rotation = links.position, links.rotation
        self.twist, self.acceleration = links.twist, links.acceleration
        self.hold = Hold()
        self._torque, self._braked = np.zeros(n), np.zeros(n, np.uint8)
        self._friction, self._work = np.zeros(n), np.zeros(4)

    def step(self, torque: Array, braked: Braked, base_acceleration: Array, dt: float) -> None:
        """Advance by dt under constant inputs.

        Args:
            torque: of the motors, (n,) [N m or N].
            braked: which rotors the brakes hold, (n,).
            base_acceleration: (3,) [m/s^2].
            dt: period [s].
        """
        np.subtract(self._gravity, base_acceleration, out=self._links.gravity)
        self._torque[:], self._braked[:] = torque, braked
        self._move(dt / self._substeps)
        self._observe()

    @property
    def work(self) -> Work:
        """Done on the joints so far."""
        return Work(*self._work.tolist())

    @abstractmethod
    def _move(self, h: float) -> None:
        """All substeps of a period, each of h [s]."""

    @abstractmethod
    def kinetic_energy(self) -> float:
        """Kinetic energy of links and rotors [J]."""

    @abstractmethod
    def spring_energy(self) -> float:
        """In what yields between them [J]."""

    def potential_energy(self) -> float:
        """Potential energy of the links in the field of gravity [J]."""
        robot = self._robot
        return float(pin.computePotentialEnergy(robot.model, robot.data, robot.configuration(self.q)))

    def _chain(self, dry: Array) -> Any:
        """What is held as C knows it, with the largest dry friction of its joints (n,)."""
        links = self._links
        return chain(self.hold, links.inverse, links.J, dry, self._friction)

    def _observe(self) -> None:
        self._links.observe()


class SeriesElasticArm(HeldArm):
    """Rotor, spring and link of every joint."""

    def __init__(
        self,
        robot: Robot,
        frame: str,
        rotor: Array,
        stiffness: Array,
        damping: Array,
        brake: Array,
        substeps: int,
        friction: Friction | None = None,
    ) -> None:
        """Rotor inertia [kg m^2], spring [N m/rad], [N m s/rad], holding torque of the brakes [N m], (n,)."""
        n = robot.nv
        super().__init__(robot, frame, np.zeros(n), substeps)
        dry = friction or Friction.none(n)
        self._rotor, self._stiffness = rotor, stiffness
        self.motor, self.motor_rate = np.zeros(n), np.zeros(n)
        self._held = self._chain(dry.bearing)
        self._core = ffi.new("elastic *", {"n": n})
        bind(
            lib,
            self._core,
            stiffness=stiffness,
            damping=damping,
            rotor=rotor,
            viscous=robot.damping,
            brake=brake,
            gear=dry.gear,
            share=dry.share,
            torque=self._torque,
            push=self.push,
            braked=self._braked,
            qdd=self.qdd,
            q=self.q,
            qd=self.qd,
            motor=self.motor,
            motor_rate=self.motor_rate,
            spring=self.spring,
            load=self._links.load,
            work=self._work,
        )

    def reset(self, q: Array) -> None:
        """Rest at q with the springs loaded by gravity."""
        self.q[:], self.qd[:], self.qdd[:] = q, 0.0, 0.0
        robot = self._robot
        gravity = pin.computeGeneralizedGravity(robot.model, robot.data, robot.configuration(self.q))
        self.spring[:] = gravity
        self.motor[:], self.motor_rate[:] = q + gravity / self._stiffness, 0.0
        self._observe()

    def _move(self, h: float) -> None:
        links = self._links
        links.check(lib.elastic_move(self._core, links.core, self._held, h, self._substeps))

    def energy(self) -> float:
        """Kinetic and potential energy of links, rotors and springs [J]."""
        return self.kinetic_energy() + self.potential_energy() + self.spring_energy()

    def kinetic_energy(self) -> float:
        """See ``HeldArm``."""
        robot = self._robot
        links = pin.computeKineticEnergy(robot.model, robot.data, robot.configuration(self.q), self.qd)
        return float(links) + self.rotor_energy()

    def rotor_energy(self) -> float:
        """Kinetic energy of the rotors [J]."""
        return float(0.5 * self._rotor.dot(self.motor_rate**2))

    def spring_energy(self) -> float:
        """See ``HeldArm``."""
        return float(0.5 * self._stiffness.dot((self.motor - self.q) ** 2))


class DirectArm(HeldArm):
    """Joints in which nothing yields: rotor and link move as one. A closed brake holds with its torque."""

    def __init__(
        self,
        robot: Robot,
        frame: str,
        rotor: Array,
        brake: Array,
        substeps: int,
        friction: Friction | None = None,
    ) -> None:
        """Rotor inertia [kg m^2 or kg], holding torque of the brakes [N m or N], (n,)."""
        own = Robot(robot.model.copy())  # whose gravity and armature are its own
        own.damping = robot.damping
        super().__init__(own, frame, rotor, substeps)
        self._robot.model.armature = rotor
        rubs = friction or Friction.none(own.nv)
        self.motor, self.motor_rate = self.q, self.qd
        self._dry, self._field = np.zeros(own.nv), own.model.gravity
        self._held = self._chain(self._dry)
        self._core = ffi.new("direct *", {"n": own.nv})
        bind(
            lib,
            self._core,
            viscous=own.damping,
            brake=brake,
            gear=rubs.gear,
            share=rubs.share,
            bearing=rubs.bearing,
            torque=self._torque,
            push=self.push,
            braked=self._braked,
            spring=self.spring,
            rotor=rotor,
            qdd=self.qdd,
            q=self.q,
            qd=self.qd,
            load=self._links.load,
            dry=self._dry,
            work=self._work,
        )

    def reset(self, q: Array) -> None:
        """Rest at q under gravity, which the brakes hold."""
        self.q[:], self.qd[:], self.qdd[:] = q, 0.0, 0.0
        robot = self._robot
        self.spring[:] = pin.computeGeneralizedGravity(robot.model, robot.data, robot.configuration(self.q))
        self._observe()

    def _move(self, h: float) -> None:
        robot, links = self._robot, self._links
        links.check(lib.direct_move(self._core, links.core, self._held, h, self._substeps))
        model, q = robot.model, robot.configuration(self.q)
        self._field.linear = links.gravity
        moving = pin.rnea(model, robot.data, q, self.qd, self.qdd)
        np.subtract(moving, links.J.T @ self.hold.wrench + self.push, out=self.spring)
        self._field.linear = self._gravity
        lib.direct_feel(self._core, self._held)

    def _inertia(self, q: Array) -> Array:
        upper = np.triu(pin.crba(self._robot.model, self._robot.data, q))
        M: Array = upper + np.triu(upper, 1).T
        return M

    def kinetic_energy(self) -> float:
        """See ``HeldArm``."""
        return float(0.5 * self.qd @ self._inertia(self._robot.configuration(self.q)) @ self.qd)

    def spring_energy(self) -> float:
        """Nothing yields."""
        return 0.0


class VelocityAxes:
    """Prescribed axes with a first-order velocity loop and limited acceleration (their inverters' own).

    Attributes:
        position, velocity, acceleration: one an axis [m, s].
        carried: the same of what they carry, whose first directions they are, (3, 3).
    """

    def __init__(
        self, time_constant: float, acceleration: float, lower: Sequence[float], upper: Sequence[float]
    ) -> None:
        """Time constant of the loop [s], rated acceleration [m/s^2], hard stops, one an axis [m]; up to 3."""
        n = len(lower)
        self.carried = np.zeros((3, 3))
        self.position, self.velocity, self.acceleration = self.carried[:, :n]
        self._command, self._braked = np.zeros(n), np.zeros(n, np.uint8)
        self._core = ffi.new("axes *", {"n": n, "time_constant": time_constant, "rated": acceleration})
        bind(
            lib,
            self._core,
            lower=np.array(lower, float),
            upper=np.array(upper, float),
            command=self._command,
            braked=self._braked,
            position=self.position,
            velocity=self.velocity,
            acceleration=self.acceleration,
        )

    def step(self, command: Sequence[float] | Array, braked: Braked, dt: float) -> None:
        """Advance by dt towards velocities, one an axis [m/s]; braked axes stop at the rated acceleration."""
        self._command[:], self._braked[:] = command, braked
        lib.axes_step(self._core, dt)
