"""An arm between process image and gate: estimation, force control, tracking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import numpy as np
from numpy.typing import NDArray

from ...control.chain import Gains, Horizons, JointSum
from ...control.estimation import WrenchEstimator
from ...control.force_control import Box, ForceControl
from ...control.force_control import Posture as Home
from ...control.look_ahead import Stop
from ...control.serial import SerialChain
from ...control.standstill import Standstill
from ...control.tracking import SLOW, DriveFriction, SeriesElasticity
from ...devices.force_torque import ForceTorques
from ...devices.image import ProcessImage
from ...devices.torque_drive import JointDrives
from ...hqp import REMARKS
from ...models import Array, Robot
from ...runtime.core.machine import REST_S
from ...runtime.core.measured import alive, sensor
from ...runtime.core.stages import Mark
from ...runtime.core.torque_axes import TorqueAxes, peaks_of
from ...safety import Plausibility
from ..rendering.exchanging import ExchangesTwins
from ..rendering.foresight import REACTION_S, Foresight
from ..rendering.giving_way import Announcer, compliance_of
from ..rendering.logged import (
    Field,
    StateLog,
    felt_beside,
    given_way,
    heated,
    levels_of,
    motion,
    solved,
    twin_fields,
    watched,
)
from ..rendering.ratings import Ratings
from ..rendering.rendering import JOINTS_AT_REST, Rendering, pulled, sensor_pose
from ..rendering.sections import SPRINGS_DIFFER, Twin
from ..rendering.tool import carrying, tool_of
from ..rendering.twin import twin_of
from .config import DIRECTIONS, ArmConfig, RevoluteJoint

STILL = np.zeros(2)
"""Acceleration of a base that stands."""
STRONG = 100.0, 10.0
"""Full scales of a sensor that drifts, and of a hand that pulls, as at a strong arm [N, N m]."""


def state_layout(
    m: int,
    sums: int,
    points: int,
    twins: Mapping[str, Twin],
    coupled: tuple[int, ...],
    levels: int,
    springs: int = 0,
    heats: int = 0,
    gives: int = 0,
    passivity: bool = False,
) -> np.dtype[np.void]:
    """What the log keeps of a tick: numbers first, then flags and the solver."""
    measured = [("link", "<f8", m), ("points", "<f8", (points, 3))]  # link side [rad or m]; boxed frames [m]
    known: list[Field] = [("stiffness", "<f8", springs)] if springs else []  # of the springs, by now
    own = [*known, *heated(heats), *given_way(gives), *watched(passivity)]
    flags = solved(m, m + sums + 3 * points, levels, twins, coupled)
    return np.dtype([*measured, *motion(m), *own, *twin_fields(twins), *flags])


class SerialArm(ExchangesTwins):
    """See ``Machine``. No accelerometer: the weight of the handle follows from joints and their commands."""

    outputs: tuple[tuple[str, str], ...] = (("joints", "target_torque"),)

    def __init__(self, config: ArmConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        arm, dt = config.arm, 1.0 / config.loop.rate
        device, described = config.devices["force_torque"], robot
        robot = carrying(robot, arm.frames.handle, arm.frames.sensor, device, arm.handle)
        self._joints, self._force_torque = JointDrives(image), ForceTorques(image)
        self.force_control = control = force_control(config, robot, dt)
        self.notes: list[str] = []
        self.twins = config.twin_names
        self._announcer = Announcer(list(arm.joints), control.compliance, self.notes, dt)
        ratings = joint_ratings(config, robot)
        joints = arm.joints.values()
        rotor, p_gain, d_gain = (
            np.array([getattr(joint, key) for joint in joints], float)
            for key in ("rotor_inertia", "p_gain", "d_gain")
        )
        stiffness = ratings.axes.believed  # of which the checks of the encoders learn more
        self._known = stiffness if np.isfinite(stiffness).all() else stiffness[:0]
        elasticity = SeriesElasticity(rotor, stiffness)
        self.axes, heat = ratings.axes.limits(config), ratings.axes.heat(image, dt)
        self._used = heat.used if ratings.axes.peaks else heat.used[:0]
        self._rendering = Rendering(
            *(robot, control, self._joints, elasticity, drive_friction(config), (p_gain, d_gain)),
            *(self.axes, heat, mark, dt, config.arming.fade),
            watched=arm.force_control.passivity,
            lead=arm.force_control.lead,
        )
        self._measure(config, robot, dt)
        rated = ratings.limits
        stop = Stop(
            control.qd, np.full(robot.nv, REACTION_S), control.qd, rated.acceleration, control.ability
        )
        self._foresight = Foresight(
            config.look_ahead,
            *(described, foreseen_limits(config, robot), self._joints.link_position, stop, _boxes(config)),
        )
        sums, boxes = len(arm.sums or ()), len(arm.boxes or ())
        self.levels, self.remarks = levels_of(control), REMARKS
        self.state = state_layout(
            *(robot.nv, sums, boxes, config.twins, directions(config), len(self.levels)),
            *(len(self._known), len(self._used)),
            gives=robot.nv if config.compliance else 0,
            passivity=arm.force_control.passivity,
        )
        self.play, self.braking = ratings.play, ratings.braking
        self.thresholds = ratings.axes.thresholds(config, image)
        scales = self._force_torque.scales[0]
        self._force = sensor(image, "force_torque", 0, self._force_torque.wrench[0], scales, dt)
        self.plausibility = Plausibility(
            (ratings.axes.checks(config, image, stiffness=stiffness, heat=heat),), (self._force,)
        )
        self._standstill = Standstill((JOINTS_AT_REST,) * robot.nv, round(REST_S * config.loop.rate))
        self.position: list[float] = [0.0] * robot.nv
        self.velocity: list[float] = [0.0] * robot.nv
        self.astray: list[bool] = [False] * robot.nv
        self.overload = ""
        self.raw_wrench: list[float] | None = None
        self.inertial = True  # it needs no accelerometer
        self.commands: list[float] = [0.0] * robot.nv
        self.solved = True

    def _measure(self, config: ArmConfig, robot: Robot, dt: float) -> None:
        """Kinematics at the measured joints, and the operator's wrench."""
        arm = config.arm
        names = list(dict.fromkeys([arm.frames.handle, *(box.frame for box in arm.boxes or ())]))
        self._chain = SerialChain(robot, names)
        self._chain.bind(self._joints.link_position, self._joints.velocity)
        frames = dict(zip(names, self._chain.frames, strict=True))
        self._handle = frames[arm.frames.handle]
        self._points = [frames[box.frame].position for box in arm.boxes or ()]
        self._gravity = robot.model.gravity.linear.copy()
        self._driven = np.zeros(robot.nv)  # accelerations that the joints were told, 0 where none
        self._specific = np.zeros(3)
        tool = tool_of(arm.handle, config.devices["force_torque"])
        self._estimator = WrenchEstimator(
            tool.mass,
            tool.centre,
            sensor_pose(robot, arm.frames.handle, arm.frames.sensor),
            self._force_torque.wrench[0],
            self._specific,
            self._handle.rotation,
            dt,
            tool.bias,
            drifts(self._force_torque.scales[0]),
        )

    @property
    def ahead(self) -> str:
        """What the arm would have met if it went on; see ``Foreseeing``."""
        return self._foresight.ahead

    @property
    def pressed(self) -> str:
        """What the hand pushes together while the arm is held; see ``Foreseeing``."""
        return self._foresight.pressed

    @property
    def inside_limits(self) -> bool:
        """Whether the measured posture may be engaged."""
        return all(a.lower <= q <= a.upper for a, q in zip(self.axes, self.position, strict=True))

    def unrest(self, first: bool) -> list[str]:
        """Sensors that show at rest what they should not; later a hand may pull: its motors hold more."""
        if not (first or self._rendering.doubtful):
            return []
        found = pulled(self._estimator.wrench, self._force_torque.scales[0])
        self._rendering.doubtful &= bool(found)
        return found

    def estimate(self) -> None:
        """Measured joints, and the operator's wrench from what they were told to do."""
        self.position, self.velocity = self._joints.link_position.tolist(), self._joints.velocity.tolist()
        self._chain.update()
        handle = self._handle
        acceleration = handle.J[:3] @ self._driven + handle.drift[:3] - self._gravity
        np.matmul(acceleration, handle.rotation, out=self._specific)
        self._driven[:] = 0.0  # until this tick commands a motion
        if alive(self._force, self.velocity, self.thresholds) and self._force_torque.ready(0):
            self.raw_wrench = self._force_torque.wrench[0].tolist()
            self._estimator.update()
        else:  # the last estimate stands, and is faded out
            self.raw_wrench = None

    def engage(self) -> None:
        """Commanded state = measured link side, twin on the handle, everything at rest."""
        self._rendering.engage(self._joints.link_position, self._estimator.wrench)
        self._foresight.reset()
        self.solved = True

    def update(self, gain: float, trust: float) -> None:
        """One tick of HapticGiant, Fig. 4, on a base that stands."""
        self._standstill.reset()
        self.solved = self._rendering.render(self._estimator.wrench, gain, trust, STILL)
        self.astray = self._rendering.astray
        self.overload = self._rendering.overload
        self._announcer.update()
        self._foresight.update()
        self._command()

    def brake(self, dropped: Sequence[bool]) -> bool:
        """Arm to rest within its limits; then hold."""
        wrench = None if self.raw_wrench is None else self._estimator.wrench
        self._rendering.slow_down(STILL, wrench, together=not any(dropped))
        self.astray = self._rendering.astray
        self.overload = self._rendering.overload
        self._foresight.hold()
        self._command()
        return self._standstill.update(self.plausibility.speed, dropped) and self._rendering.still

    def _command(self) -> None:
        self.commands = self._rendering.torque(STILL)
        self._driven[:] = self.force_control.qdd
        self._rendering.advance()

    def bind_state(self, state: NDArray[np.void]) -> None:
        """See ``state_layout``: its numbers come first and are copied in one go."""
        control = self.force_control
        measured = (self._joints.link_position, *self._points)
        numbers = (
            *measured,
            control.q,
            control.qd,
            control.qdd,
            self._known,
            self._used,
            *felt_beside(control),
        )
        self._log = StateLog(state, numbers, self._rendering)

    def fill(self) -> None:
        """Copy the state of this tick."""
        self._log.fill()


def foreseen_limits(config: ArmConfig, robot: Robot) -> tuple[Array, Array]:
    """Lower and upper limits of the joints, (m,) each [rad or m]."""
    limits = joint_ratings(config, robot).limits
    return limits.lower, limits.upper


def directions(config: ArmConfig) -> tuple[int, ...]:
    """Numbers, 0 to 5, of the directions in which handle and twin are coupled."""
    return tuple(DIRECTIONS.index(name) for name in config.arm.directions)


def drifts(scales: Sequence[float]) -> tuple[float, float]:
    """Parts of a strong arm's drift of force and torque, for a sensor with full scales (6,) [N, N m].

    A weak arm is led with little force: all of it would pass for the drift of a sensor many times too large.
    """
    return min(1.0, scales[0] / STRONG[0]), min(1.0, scales[3] / STRONG[1])


def drive_friction(config: ArmConfig) -> DriveFriction:
    """What is fed forward of the joints' friction."""
    joints = config.arm.joints.values()

    def given(key: str) -> Array:
        return np.array([getattr(joint, key) or 0.0 for joint in joints], float)

    return DriveFriction(
        gear=given("gear_friction"),
        damping=given("gear_damping"),
        share=given("load_friction"),
        bearing=given("bearing_friction"),
        slow=SLOW * given("velocity"),
    )


def joint_ratings(config: ArmConfig, robot: Robot) -> Ratings:
    """The joints of an arm; their order is the model's."""
    joints, safety = list(config.arm.joints.values()), config.safety
    slides = safety.position_margin if safety.slide_margin is None else safety.slide_margin
    stiffness = [inf if joint.stiffness is None else joint.stiffness for joint in joints]
    axes = TorqueAxes(
        tuple(config.arm.joints),
        lower=[joint.range[0] for joint in joints],
        upper=[joint.range[1] for joint in joints],
        velocity=[joint.velocity for joint in joints],
        torque=robot.effort.tolist(),
        stiffness=stiffness,
        rotor=[joint.rotor_inertia for joint in joints],
        doubt=SPRINGS_DIFFER if config.arm.stiffness_tolerance is None else config.arm.stiffness_tolerance,
        peaks=peaks_of(config.devices, list(config.arm.joints)),
        margin=[safety.position_margin if isinstance(joint, RevoluteJoint) else slides for joint in joints],
    )
    return Ratings(
        axes, stiffness, [joint.acceleration for joint in joints], [joint.p_gain for joint in joints]
    )


def force_control(config: ArmConfig, robot: Robot, dt: float) -> ForceControl:
    """The hierarchical force control that a configuration describes."""
    arm, gains = config.arm, config.arm.force_control
    coupled, ratings = directions(config), joint_ratings(config, robot)
    joints = arm.joints.values()
    yielding = np.array([1.0 / joint.p_gain + 1.0 / (joint.stiffness or inf) for joint in joints])
    return ForceControl(
        robot,
        ratings.limits,
        [twin_of(twin, coupled) for twin in config.twins.values()],
        joint_sums(config),
        _boxes(config),
        Gains(gains.p_gain, gains.p_gain, gains.d_gain, gains.d_gain),
        gains.detection,
        dt,
        Horizons(gains.viability_horizon, gains.point_horizon),
        directions=coupled,
        handle=arm.frames.handle,
        posture=_home(config),
        limited=gains.detection == "gauss",
        compliance=compliance_of(config.compliance, ratings.axes.torque, ratings.limits, yielding),
    )


def _boxes(config: ArmConfig) -> list[Box]:
    return [Box(box.frame, box.lower, box.upper) for box in config.arm.boxes or ()]


def joint_sums(config: ArmConfig) -> list[JointSum]:
    """Sums of joints with limits of their own."""
    names = list(config.arm.joints)
    return [
        JointSum([total.weights.get(name, 0.0) for name in names], *total.range)
        for total in config.arm.sums or ()
    ]


def _home(config: ArmConfig) -> Home | None:
    posture = config.arm.posture
    if posture is None:
        return None
    home: Array = np.array([joint.home for joint in config.arm.joints.values()], float)
    return Home(home, posture.stiffness, posture.damping)
