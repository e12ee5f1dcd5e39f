"""A redundant interface between process image and gate: contact-aware null-space control (ContactAware)."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot

import numpy as np
from numpy.typing import NDArray

from ...control.hold import Hold, HoldGains
from ...control.standstill import Standstill
from ...devices.force_torque import ForceTorques
from ...devices.image import ProcessImage
from ...devices.joint_drive import JointDrive
from ...devices.torque_drive import JointDrives
from ...hqp import REMARKS
from ...models import ModelError, Robot
from ...runtime.core.machine import DRIFT, REST_S, LevelSpec, UnfitError
from ...runtime.core.measured import alive, sensor
from ...runtime.core.stages import Mark, Stage
from ...runtime.core.torque_axes import TorqueAxes
from ...safety import Plausibility
from .bodies import surroundings
from .config import Rhi, RhiAssist, RhiConfig, RhiPlane, RhiResist
from .contact_aware import ContactAware, Settings
from .environment import Environment
from .guard import Span
from .hierarchy import Hierarchy
from .manipulability import Shape, force_ellipsoid
from .nullspace import Gains
from .places import Place, Places, surface_places
from .redundant import AXES, LEVER, PLACE, RedundantArm
from .tool import Tool
from .transition import Thresholds as Reserves

HOLDABLE = 0.8
"""Part of the motors' torques that the hand may take at a start: the rest is for the hold itself."""
HANDOVER = 10.0
"""The hold hands over to the controller so many times as fast as that fades in."""
STEADY_S = 20e-3
"""Time constant of the hand's pull that the hold takes over: a hand that has just jerked is not held."""
SUPPORT_FADE_S = 5e-3
"""Time constant with which what the measured hand contributed leaves the torques of a stop."""
SWING = 0.1
"""Fastest swing of the posture [rad] in a tick."""
DRAGGED_S = 15e-3
"""How far ahead a motor is to be inside its limits [s]: by then its brake holds it."""
AT_REST = 0.25
"""Measured speeds below this are standstill: a hand goes on pulling at motors that hold [rad/s]."""
MOVE = "move the bodies, or widen rhi.motors.lower and upper"


SOLVED = ("iterations", "solves", "status", "levels_done")
"""What the log keeps of a solve, by its names there and in the resolution."""


def state_layout(n: int, m: int, levels: int) -> np.dtype[np.void]:
    """What the log keeps of a tick, for n motors, m directions, levels of the solver; numbers first."""
    return np.dtype(
        [
            ("q", "<f8", n),  # measured [rad]
            ("qd", "<f8", n),
            ("torque", "<f8", n),  # commanded [N m]
            ("null", "<f8", n),  # its null-space part before scaling [N m]
            ("position", "<f8", m),  # of the hand; turns times the lever [m]
            # measured force of the hand on the handle [N], with turns its torque [N m], in the base's axes
            ("hand", "<f8", PLACE if m <= PLACE else m),
            ("demand", "<f8", m),  # force that the environment asks for; torques over the lever [N]
            ("depth", "<f8"),  # in the body in which it is deepest [m]
            ("reserve", "<f8"),  # V
            ("omega", "<f8"),  # activation of the free ellipsoid
            ("alpha", "<f8"),  # rendered share of the force
            ("cost", "<f8"),  # Stein divergence v
            ("drive", "<f8"),  # norm of the pull on the posture [N m]
            ("energy", "<f8"),  # that the rendered force has taken from the hand in this contact [J]
            ("iterations", "<u2"),
            ("solves", "u1"),
            ("status", "i1"),
            ("levels_done", "u1"),
            ("slack", "<f8", (levels,)),  # of each level
        ]
    )


class RedundantInterface:
    """See ``Machine``. Of the wrench of the hand the law takes the direction of contact, nothing else."""

    outputs: tuple[tuple[str, str], ...] = (("joints", "target_torque"),)

    def __init__(self, config: RhiConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        rhi, dt = config.rhi, 1.0 / config.loop.rate
        self._mark = mark
        self._drives, self._force_torque = JointDrives(image), ForceTorques(image)
        self._arm = arm = redundant_arm(config, robot)
        self.environment = surroundings(rhi, arm)
        self._config, self._places = config, contact_places(config, arm, self.environment, _span(rhi))
        self.controller = law(config, arm, self._places, dt)
        self._hold = Hold(_hold_gains(config), dt)
        self._holding, self._share = False, 1.0  # of the controller's torques; less while a start hands over
        self._fade = exp(-dt / SUPPORT_FADE_S)
        self._limit = np.array(rhi.motors.torque)
        self._measured = self._force_torque.wrench[0]
        self._wrench = np.zeros(2 * PLACE)
        # of it the hand's force, and where it turns the handle, its torque
        self._hand = self._wrench[: PLACE if arm.m <= PLACE else 2 * PLACE]
        self._turned = [
            (self._measured[k : k + PLACE], self._wrench[k : k + PLACE]) for k in range(0, 2 * PLACE, PLACE)
        ]
        self._measured_force = self._measured[:PLACE]
        self._demand = [0.0] * arm.m
        self.levels = tuple(LevelSpec(*level) for level in self.controller.resolution.levels)
        self.remarks = REMARKS
        self.state = state_layout(arm.n, arm.m, len(self.levels))
        motors, torque, hold = rhi.motors, rhi.motors.torque, rhi.hold.stiffness
        limited = TorqueAxes(
            *(drive_names(config), motors.lower, motors.upper, motors.velocity, torque),
            acceleration=motors.acceleration,
        )
        self.axes, self.thresholds = limited.limits(config), limited.thresholds(config, image)
        self.play = tuple(most / k for most, k in zip(torque, hold, strict=True))
        scales = self._force_torque.scales[0]
        self._force = sensor(image, "force_torque", 0, self._measured, scales, dt)
        self._rows = [AXES.index(name) for name in rhi.task.directions]
        self._beside = np.ones(2 * PLACE)  # which directions are none of the task's
        self._beside[self._rows] = 0.0
        self._felt, self._scale = np.zeros(arm.m), np.ones(arm.m)
        self._scale[PLACE:] = 1.0 / arm.lever
        self._pull = np.zeros(arm.n)  # torques that hold the hand's wrench
        self._balance = np.zeros(arm.n)  # torques that hold that and the arm's own weight
        self._steady = np.zeros(arm.n)  # the former, smoothed
        self._smooth = 1.0 - exp(-dt / STEADY_S)
        self._support = np.zeros(arm.n)  # the part of them that the hold gives
        self.plausibility = Plausibility((limited.checks(config, image, self._balance),), (self._force,))
        self._standstill = Standstill((AT_REST,) * arm.n, round(REST_S * config.loop.rate))
        self.position: list[float] = [0.0] * arm.n
        self.velocity: list[float] = [0.0] * arm.n
        self.astray = [False] * arm.n  # which of them a hand drags over their limits
        self.overload = ""  # the first of these; what the motors cannot render they leave out
        self._ends = tuple(zip(drive_names(config), motors.lower, motors.upper, strict=True))
        self.raw_wrench: list[float] | None = None
        self.inertial = True  # it needs no accelerometer
        self.braking = max(v / a for v, a in zip(motors.velocity, motors.acceleration, strict=True))
        self.commands: list[float] = [0.0] * arm.n
        self.solved = True

    def prepare(self) -> None:
        """See ``Preparing``: postures for contact with the bodies."""
        find_postures(self.controller, self._config, self._places, 1.0 / self._config.loop.rate)

    @property
    def inside_limits(self) -> bool:
        """Whether the measured posture may be engaged."""
        return all(a.lower <= q <= a.upper for a, q in zip(self.axes, self.position, strict=True))

    def unrest(self, first: bool) -> list[str]:
        """The handle is pulled: at the first start at all, later by more than the motors could hold."""
        force, most = hypot(*self._measured_force.tolist()), DRIFT * self._force_torque.scales[0][0]
        if first and force > most:
            return [f"the handle is pulled with {force:.1f} N; let go, or check the sensor"]
        if (np.abs(self._pull) > HOLDABLE * self._left()).any():
            return [f"the handle is pulled with {force:.1f} N, more than the motors hold; pull less"]
        return []

    def estimate(self) -> None:
        """Measured motors, and the wrench of the hand in the base's axes."""
        drives, arm = self._drives, self._arm
        arm.q[:], arm.qd[:] = drives.link_position, drives.velocity
        self.position, self.velocity = arm.q.tolist(), arm.qd.tolist()
        valid = alive(self._force, self.velocity, self.thresholds) and self._force_torque.ready(0)
        self.raw_wrench = self._measured.tolist() if valid else None
        arm.update()
        for measured, turned in self._turned:
            np.matmul(arm.rotation, measured, out=turned)
        np.take(self._hand, self._rows, out=self._felt)
        np.multiply(self._felt, self._scale, out=self._felt)
        np.matmul(self._felt, arm.J, out=self._pull)
        np.negative(self._pull, out=self._pull)
        # what no direction of the task is: the motors hold it all the same, and stand still under it
        self._pull -= arm.load(self._wrench * self._beside)
        np.add(self._pull, arm.weight, out=self._balance)
        self._steady += self._smooth * (self._pull - self._steady)

    def engage(self) -> None:
        """Held where it is measured, against the hand that is measured; then free motion from there."""
        self.environment.force(self._arm.position.tolist())
        self.controller.reset(self.environment.granted)
        self._hold.reset(self._arm.q, np.zeros(self._arm.n))
        self._holding, self._share = True, 0.0
        most = HOLDABLE * self._left()
        np.clip(self._steady, -most, most, out=self._support)
        self.solved = True

    def update(self, gain: float, trust: float) -> None:
        """One tick of ContactAware, fig. 5."""
        position, velocity = self._arm.position.tolist(), self._arm.velocity.tolist()
        self._demand = self.environment.force(position, velocity)
        self._mark(Stage.MODEL)
        felt = self._felt.tolist() if self.raw_wrench is not None else None
        self.solved = self.controller.update(self._demand, gain, self.environment.energy, felt)
        self._mark(Stage.SOLVE)
        self._standstill.reset()
        self.astray = self._dragged()
        self.overload = self._ends[self.astray.index(True)][0] if True in self.astray else ""
        if not self.solved:
            self._hold_back()
            return
        self._share = max(self._share, min(1.0, HANDOVER * gain))
        self._holding = self._share < 1.0
        torque = self.controller.torque
        if self._holding:
            held = self._held_torque()
            torque = held + self._share * (torque - held)
        self.commands = torque.tolist()

    def brake(self, dropped: Sequence[bool]) -> bool:
        """Motors to rest at their rated accelerations, then hold; one that a hand drags is its brake's."""
        self._hold_back()
        at_rest = self._standstill.update(self.plausibility.speed, dropped) and self._hold.at_rest
        return at_rest or True in self._dragged()

    def _dragged(self) -> list[bool]:
        """Of each motor, whether it is on the way over its limit: posture and end stop are too weak."""
        rows = zip(self.position, self.velocity, self._ends, strict=True)
        return [not lower <= q + DRAGGED_S * qd <= upper for q, qd, (_, lower, upper) in rows]

    def _hold_back(self) -> None:
        """Before the start hands over, its hold; later a hold that begins where the motors are."""
        arm = self._arm
        if self._share > 0.0:
            if not self._holding or self._share < 1.0:
                self._hold.reset(arm.q, arm.qd)
                self._support *= 1.0 - self._share
                self._holding, self._share = True, 1.0
            self._support *= self._fade
        self.commands = self._held_torque().tolist()

    def _held_torque(self) -> NDArray[np.float64]:
        torque = self._hold.update(self._arm.q, self._arm.qd) + self._support + self._arm.weight
        return np.clip(torque, -self._limit, self._limit, out=torque)

    def _left(self) -> NDArray[np.float64]:
        """What the arm's own weight leaves of the motors' torques, (n,)."""
        left: NDArray[np.float64] = np.maximum(self._limit - np.abs(self._arm.weight), 0.0)
        return left

    def bind_state(self, state: NDArray[np.void]) -> None:
        """See ``state_layout``."""
        arm, controller = self._arm, self.controller
        self._numbers = (
            *(arm.q, arm.qd, self._drives.target_torque, controller.space.null),
            *(arm.position, self._hand),
        )
        count = sum(len(numbers) for numbers in self._numbers) + arm.m + 7
        self._logged = state.view(np.uint8)[: 8 * count].view(np.float64)
        self._logged_solve = tuple(state[name] for name in SOLVED)
        self._logged_slack, self._slack = state["slack"][0], np.zeros(len(self.levels))

    def fill(self) -> None:
        """Copy the state of this tick."""
        controller, space = self.controller, self.controller.space
        observed = (self.environment.depth, controller.reserve, controller.transition.omega)
        scalars = (*observed, controller.alpha, space.cost, space.drive, controller.tank.energy)
        np.concatenate((*self._numbers, self._demand, scalars), out=self._logged)
        resolution = controller.resolution
        for logged, name in zip(self._logged_solve, SOLVED, strict=True):
            logged[0] = getattr(resolution, name)
        resolution.write_slack(self._slack)
        self._logged_slack[:] = self._slack


def redundant_arm(config: RhiConfig, robot: Robot) -> RedundantArm:
    """The controller's model of the interface."""
    motors, task = config.rhi.motors, config.rhi.task
    transmission, rotor = np.array(motors.transmission), np.array(motors.rotor_inertia)
    lever = LEVER if task.lever is None else task.lever
    arm = RedundantArm(robot, task.frame, task.directions, transmission, rotor, lever)
    arm.refer(np.array(task.home))
    return arm


def contact_aware(
    config: RhiConfig, arm: RedundantArm, rendered: Environment | Tool, dt: float
) -> ContactAware:
    """The controller that a configuration describes, with the postures for contact that it looks for.

    Raises:
        UnfitError: the hand cannot be held at any body.
    """
    places = contact_places(config, arm, rendered, _span(config.rhi))
    controller = law(config, arm, places, dt)
    find_postures(controller, config, places, dt)
    return controller


def law(config: RhiConfig, arm: RedundantArm, places: Sequence[Place], dt: float) -> ContactAware:
    """The controller that a configuration describes, for its arm, without postures for contact.

    Raises:
        UnfitError: there is no place, the hand cannot be held at any body.
    """
    rhi = config.rhi
    limit, task, saturation = np.array(rhi.motors.torque), rhi.task, rhi.saturation
    space = rhi.null_space
    spare = arm.n > arm.m  # without, the hand's place says all of the posture, and nothing is to be turned
    scanned = space.scan if spare else 0
    span = _span(rhi)
    settings = Settings(
        shape=_shape(rhi, arm),
        gains=Gains(
            space.step if spare else 0.0,
            space.damping,
            space.cap,
            space.stiffness if scanned else 0.0,
            rhi.motors.friction,
            space.ratio,
            SWING / dt,
        ),
        thresholds=Reserves(saturation.leave, saturation.come_back),
        steepness=saturation.steepness,
        rho=saturation.rho,
        held=saturation.held if spare else 1.0,
        moving=saturation.moving,
        release=saturation.release,
        follow=task.follow if task.follow is not None else np.inf,
        span=span,
        linger=saturation.linger or 0.0,
        urgency=saturation.urgency,
    )
    if not places:
        problem = f"no posture holds the hand in any of them: {', '.join(rhi.bodies)}"
        raise UnfitError("rhi.bodies", problem, MOVE)
    controller = ContactAware(arm, limit, places[0][1].tolist(), settings, dt)
    if space.resolution == "hqp":
        controller.resolution = Hierarchy(controller.space)
    arm.at(np.array(task.home))
    return controller


def find_postures(controller: ContactAware, config: RhiConfig, places: Sequence[Place], dt: float) -> None:
    """Give a controller the postures for contact at these places that its configuration asks for.

    Raises:
        UnfitError: there is none.
    """
    arm, rhi, scanned = controller.arm, config.rhi, config.rhi.null_space.scan
    if not scanned or arm.n <= arm.m:
        return
    limit, shape = np.array(rhi.motors.torque), _shape(rhi, arm)
    goals = controller.space.free, controller.space.stiff
    try:
        controller.places = Places(arm, places, shape, limit, _span(rhi), scanned, goals, dt)
    except ModelError as error:
        problem = f"no posture within the motors' limits was found there: {error.problem}"
        raise UnfitError(f"rhi.bodies.{next(iter(rhi.bodies))}", problem, MOVE) from error
    arm.at(np.array(rhi.task.home))


def contact_places(
    config: RhiConfig, arm: RedundantArm, rendered: Environment | Tool, span: Span
) -> list[Place]:
    """Places that postures are found for: a plane's own point comes first, and a field has no other."""
    spacing, found = config.rhi.null_space.spacing, list[Place]()
    first = next(iter(config.rhi.bodies.values()))
    if isinstance(first, RhiPlane):
        point, into = np.array(first.point), np.array(first.normal, float) / hypot(*first.normal)
        found.append(rendered.held(point, into) if isinstance(rendered, Tool) else (point, into))
        if spacing is None:
            return found
    surface = list(surface_places(arm, rendered, span, spacing))
    if not surface and isinstance(first, RhiAssist | RhiResist):
        point, along = np.array(first.point), np.eye(len(first.point))[0]
        surface = [rendered.held(point, along) if isinstance(rendered, Tool) else (point, along)]
    return found + surface


def _shape(rhi: Rhi, arm: RedundantArm) -> Shape:
    home = force_ellipsoid(arm.at(np.array(rhi.task.home)).J, np.array(rhi.motors.torque))
    return Shape.of_home(home, rhi.task.spread)


def _span(rhi: Rhi) -> Span:
    motors = rhi.motors
    return Span(motors.lower, motors.upper, rhi.null_space.margin, motors.velocity)


def _hold_gains(config: RhiConfig) -> HoldGains:
    hold, motors = config.rhi.hold, config.rhi.motors
    gains = (hold.stiffness, hold.damping, motors.acceleration, motors.torque)
    return HoldGains(*(np.array(values, float) for values in gains))


def drive_names(config: RhiConfig) -> list[str]:
    """Names of the motors' drives, in their order."""
    return [name for name, device in config.devices.items() if isinstance(device, JointDrive)]
