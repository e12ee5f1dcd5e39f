"""The built-in redundant interface without bus and modes: controller and plant step by step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import msgspec
import numpy as np

from ..machines.rhi.bodies import environment
from ..machines.rhi.config import RhiConfig, RhiPlane
from ..machines.rhi.contact_aware import ContactAware
from ..machines.rhi.environment import Environment
from ..machines.rhi.machine import contact_aware, redundant_arm
from ..machines.rhi.manipulability import Shape, force_ellipsoid
from ..machines.rhi.self_motion import Ellipsoid, best_posture
from ..models import Array, Robot
from ..runtime.configuration import config
from ..sim.hand import PointHand
from ..sim.rigid import RigidArm

RATE = 1000.0
SUBSTEPS = 2
HAND = (5000.0, 30.0, 60.0)
"""Stiffness [N/m], damping [N s/m] and strength [N] of the finger; so stiff that it sets the depth."""


@dataclass(frozen=True, slots=True)
class Palpation:
    """A course that goes to and fro through a point: A sin(2 pi f t) along a direction, at rest before 0.

    Attributes:
        centre: (3,) [m]; along: unit vector, (3,).
        depth: A [m]; frequency: f [Hz].
    """

    centre: Sequence[float]
    along: Sequence[float]
    depth: float
    frequency: float

    def at(self, t: float) -> tuple[list[float], list[float]]:
        """Position and velocity at time t."""
        w = 2.0 * pi * self.frequency
        s, ds = (self.depth * sin(w * t), self.depth * w * cos(w * t)) if t > 0.0 else (0.0, 0.0)
        place = [c + s * a for c, a in zip(self.centre, self.along, strict=True)]
        return place, [ds * a for a in self.along]


@dataclass(frozen=True, slots=True)
class Trace:
    """One row a tick of a simulated session.

    Attributes:
        t: (k,) [s]; torque, null: (k, n) [N m].
        position, velocity: of the hand, (k, m); force: rendered, demand: asked for, (k, m) [N].
        sensed: force of the device on the hand, as a sensor in the handle sees it, (k, m) [N].
        reserve, omega, alpha: (k,).
        work: of the hand on the plant, in each tick, (k,) [J].
    """

    t: Array
    torque: Array
    null: Array
    position: Array
    velocity: Array
    force: Array
    demand: Array
    sensed: Array
    reserve: Array
    omega: Array
    alpha: Array
    work: Array


class Device:
    """The interface of configs/rhi.toml, with changes.

    Attributes:
        config, robot: as configured.
        arm: kinematics; shape: of the desired ellipsoids; limit: of the motors, (n,) [N m].
        u: direction into the wall, (m,); centre: X0, (m,) [m].
        bounds: of the motors, (n,) each [rad].
    """

    def __init__(self, **changes: Any) -> None:
        """Changes of ``null_space`` or ``saturation``, as mappings of their fields."""
        loaded = config.load("rhi")
        assert isinstance(loaded.config, RhiConfig)
        replaced = {
            section: msgspec.structs.replace(getattr(loaded.config.rhi, section), **fields)
            for section, fields in changes.items()
        }
        rhi = msgspec.structs.replace(loaded.config.rhi, **replaced)
        self.config = msgspec.structs.replace(loaded.config, rhi=rhi)
        self.robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
        self.arm = redundant_arm(self.config, self.robot)
        self.limit = np.array(rhi.motors.torque)
        home = self.arm.at(np.array(rhi.task.home)).J
        self.shape = Shape.of_home(force_ellipsoid(home, self.limit), rhi.task.spread)
        (wall,) = rhi.bodies.values()
        assert isinstance(wall, RhiPlane)
        self.u, self.centre = np.array(wall.normal, float), np.array(wall.point)
        self.bounds = (rhi.motors.lower, rhi.motors.upper)

    def desired(self, stiff: bool) -> Ellipsoid:
        """The objective of (12) or (13) along u."""
        uu = np.outer(self.u, self.u)
        return Ellipsoid(self.shape.stiff(uu) if stiff else self.shape.free(uu), self.limit)

    def posture(self, stiff: bool, count: int = 4000) -> Array:
        """The best posture at X0 within the joint limits, (n,) [rad]."""
        return best_posture(self.arm, self.centre, self.bounds, self.desired(stiff), count)

    def controller(self) -> tuple[ContactAware, Environment]:
        """A new controller and what it renders."""
        rendered = environment(self.config.rhi.bodies)
        arm = redundant_arm(self.config, self.robot)
        return contact_aware(self.config, arm, rendered, 1.0 / RATE), rendered

    def plant(self, q: Array) -> RigidArm:
        """A plant at rest in a posture (n,)."""
        motors, simulation = self.config.rhi.motors, self.config.simulation
        assert simulation is not None
        plant = simulation.rhi
        arm = RigidArm(
            self.robot,
            self.config.rhi.task.frame,
            np.array(motors.transmission),
            np.array(motors.rotor_inertia),
            np.array(plant.friction),
            np.array(plant.brake_torque),
        )
        arm.reset(q)
        return arm

    def palpate(self, depth: float, frequency: float, duration: float, mode: str = "switching") -> Trace:
        """Palpate from the free posture (or, with mode "stiff", from the stiff one).

        Args:
            depth: amplitude of the finger's course [m].
            frequency: of it [Hz].
            duration: [s].
            mode: "switching", or "free" or "stiff" for one desired ellipsoid throughout.
        """
        controller, rendered = self.controller()
        start = controller.space.stiff if mode == "stiff" else controller.space.free
        if not start.any():
            start = self.posture(mode == "stiff")
        course = Palpation((*self.centre, 0.0), (*self.u, 0.0), depth, frequency)
        force = {"free": 0.0, "stiff": 1.0}.get(mode)
        if force is not None:
            controller.transition.freeze(force)
        return simulate(controller, self.plant(start), PointHand(course, *HAND), rendered, duration)


def simulate(
    controller: ContactAware,
    plant: RigidArm,
    hand: PointHand,
    rendered: Environment,
    duration: float,
    before_tick: Callable[[int], None] = lambda k: None,
) -> Trace:
    """Run at RATE from the plant's state.

    Raises:
        RuntimeError: the posture became singular.
    """
    arm, dt = controller.arm, 1.0 / RATE
    rows: list[tuple[Any, ...]] = []
    arm.q[:], arm.qd[:] = plant.q, plant.qd
    controller.reset()
    free, push = [False] * arm.n, [0.0] * 3
    for k in range(round(duration * RATE)):
        before_tick(k)
        t = k * dt
        arm.q[:], arm.qd[:] = plant.q, plant.qd
        arm.update()
        demand = rendered.force(arm.position.tolist(), arm.velocity.tolist())
        if not controller.update(demand, 1.0, rendered.energy, push[: arm.m]):
            raise RuntimeError(f"no torque at {t:g} s: the posture {arm.q} is singular")
        alpha = controller.alpha
        arrays = (controller.torque, controller.space.null, arm.position, arm.velocity)
        copies = [array.copy() for array in arrays]
        felt = [alpha * f for f in demand]
        scalars = (controller.reserve, controller.transition.omega, alpha)
        work, pushed = 0.0, np.zeros(3)
        for s in range(SUBSTEPS):
            at = t + s * dt / SUBSTEPS
            push = hand.force(at, plant.position.tolist(), plant.velocity.tolist())
            before = plant.position.copy()
            pushed += push
            plant.step(controller.torque, free, push, dt / SUBSTEPS)
            work += float(np.dot(push, plant.position - before))
        rows.append((t, *copies, felt, demand, -pushed[: arm.m] / SUBSTEPS, *scalars, work))
    return Trace(*(np.array(column, float) for column in zip(*rows, strict=True)))
