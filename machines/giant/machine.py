"""The giant between process image and gate: estimation, force control, prepositioning, tracking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot

import numpy as np
from numpy.typing import NDArray

from ...control.copies import Copies
from ...control.estimation import PpuObserver, WrenchEstimator
from ...control.inertial_kalman import InertialKalman
from ...control.look_ahead import Stop
from ...control.standstill import Standstill
from ...control.tracking import SeriesElasticity
from ...devices.axis_drive import AxisDrives
from ...devices.force_torque import ForceTorques
from ...devices.image import ProcessImage
from ...devices.imu import Imus
from ...devices.torque_drive import JointDrives
from ...hqp import REMARKS
from ...models import Array, Robot
from ...runtime.core.machine import GRAVITY, GRAVITY_MARGIN, REST_S
from ...runtime.core.measured import alive
from ...runtime.core.stages import Mark
from ...safety import Values
from ..rendering.exchanging import ExchangesTwins
from ..rendering.foresight import REACTION_S, Foresight
from ..rendering.giving_way import Announcer
from ..rendering.logged import (
    StateLog,
    estimated,
    felt_beside,
    given_way,
    heated,
    levels_of,
    motion,
    solved,
    twin_fields,
    watched,
)
from ..rendering.rendering import JOINTS_AT_REST, Rendering, pulled, sensor_pose
from ..rendering.sections import Twin
from ..rendering.tool import carrying, tool_of
from ..telemanipulation.leading_twin import led_fields
from ..telemanipulation.sections import Leads
from .config import GiantConfig
from .names import JOINTS, PPU_JOINTS
from .parts import (
    CARRIAGE,
    HANDLE,
    boxes_of,
    braking_time,
    drive_friction,
    force_control_of,
    foreseen_limits,
    gantry_limits,
    joint_kalman,
    leading_twin,
    plausibility_of,
    prepositioning_of,
    ratings_of,
    sensed,
    thresholds_of,
)

PPU_AT_REST = 0.05
"""Measured speeds below this are standstill: the gantry's inverters lag [m/s]."""
PPU_STILL = 0.02
"""Estimated speeds of the gantry below this end within a millimetre [m/s]."""

MACHINE_LIMITS = 13
"""Limits besides the twin's: six joints, their tilt, three directions of handle and elbow each."""


def state_layout(
    twins: Mapping[str, Twin],
    levels: int,
    peaks: bool = False,
    gives: bool = False,
    passivity: bool = False,
    leads: Leads | None = None,
    estimates: bool = False,
) -> np.dtype[np.void]:
    """What the log keeps of a tick: numbers first, then flags and the solver."""
    return np.dtype(
        [
            ("link", "<f8", 6),  # measured, link side [rad]
            ("axis", "<f8", 2),  # measured [m]
            *motion(6),
            ("stiffness", "<f8", 6),  # of the springs, as far as they are known by now [N m/rad]
            *estimated(6 if estimates else 0),
            *heated(6 if peaks else 0),
            *given_way(6 if gives else 0),
            ("ppu", "<f8", (3, 2)),  # estimated position, velocity, acceleration [m, s]
            *led_fields(leads),
            *watched(passivity),
            *twin_fields(twins),
            *solved(6, MACHINE_LIMITS, levels, twins),
        ]
    )


class Giant(ExchangesTwins):
    """HapticGiant; see ``Machine``.

    Attributes:
        kalman: estimator of rotors and links; None where these are taken as measured.
    """

    outputs: tuple[tuple[str, str], ...] = (("joints", "target_torque"), ("axes", "target_velocity"))

    def __init__(self, config: GiantConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        giant = config.giant
        tool = tool_of(giant.handle, config.devices["force_torque"])
        described = robot
        robot = carrying(robot, "handle", "force_torque", config.devices["force_torque"], giant.handle)
        dt = 1.0 / config.loop.rate
        self._joints, self._axes = JointDrives(image), AxisDrives(image)
        self._force_torque, self._imus = ForceTorques(image), Imus(image)
        manipulator = robot.without(PPU_JOINTS)
        self._acceleration, self._carriage = np.zeros(2), self._imus.acceleration[CARRIAGE, :2]
        self._raw = self._force_torque.wrench[0]
        self._observer = PpuObserver(dt, self._axes.position, self._acceleration)
        ratings = ratings_of(config, robot)
        self.force_control = control = force_control_of(config, manipulator, self._observer, ratings, dt)
        self.notes: list[str] = []
        self.twins = config.twin_names
        self._announcer = Announcer(JOINTS, control.compliance, self.notes, dt)
        self._estimator = WrenchEstimator(
            tool.mass,
            tool.centre,
            sensor_pose(robot, "handle", "force_torque"),
            self._raw,
            self._imus.acceleration[HANDLE],
            control.handle.rotation,
            dt,
            tool.bias,
        )
        self._prepositioning = prepositioning_of(config, control.q, self._observer, dt)
        tracking = giant.tracking
        stiffness = ratings.axes.believed  # of which the checks of the encoders learn more
        joints, heat = ratings.axes.limits(config), ratings.axes.heat(image, dt)
        self.kalman = self._kalman_of(config, manipulator, dt)
        self._rendering = Rendering(
            manipulator,
            control,
            self._joints,
            SeriesElasticity(np.array(tracking.rotor_inertia), stiffness),
            drive_friction(config),
            (np.array(tracking.p_gain), np.array(tracking.d_gain)),
            joints,
            heat,
            mark,
            dt,
            config.arming.fade,
            giant.force_control.passivity,
            self.kalman,
            giant.force_control.lead,
        )
        self.leading = leading_twin(config, control, image, self.notes, dt)
        self._foresee(config, described)
        self._stiffness = stiffness
        self._used = heat.used if ratings.axes.peaks else heat.used[:0]
        self.axes = (*joints, *gantry_limits(config, dt))
        self.thresholds = thresholds_of(config, image, ratings.axes.swing)
        # the gantry yields as far as it may
        self.play = (*ratings.play, *[config.safety.ppu_margin] * len(PPU_JOINTS))
        sensors = sensed(image, self._force_torque, self._raw, self._imus, dt)
        self._force, self._carried, self._held = sensors
        self.plausibility = plausibility_of(config, image, ratings, stiffness, heat, sensors)
        self.levels, self.remarks = levels_of(control), REMARKS
        gives, watches = config.compliance is not None, giant.force_control.passivity
        peaks = bool(ratings.axes.peaks)
        self.state = state_layout(
            *(config.twins, len(self.levels), peaks, gives, watches, config.leads),
            estimates=self.kalman is not None,
        )
        self._gather()
        self.position: list[float] = [0.0] * len(self.axes)
        self.velocity: list[float] = [0.0] * len(self.axes)
        self.overload = ""
        self._gantry_follows = [False] * len(PPU_JOINTS)
        self.astray: list[bool] = [False] * len(self.axes)
        self.raw_wrench: list[float] | None = None
        self.inertial = False
        self.braking = braking_time(config)
        self.commands: list[float] = [0.0] * len(self.axes)
        self.solved = True
        self._base = np.zeros(2)
        still = (JOINTS_AT_REST,) * len(JOINTS) + (PPU_AT_REST,) * len(PPU_JOINTS)
        self._standstill = Standstill(still, round(REST_S * config.loop.rate))
        self._started = False

    def _gather(self) -> None:
        """Positions and speeds of all axes side by side."""
        self._at, self._speed = np.zeros(len(self.axes)), np.zeros(len(self.axes))
        axes, joints, m = self._axes, self._joints, len(JOINTS)
        self._measured = Copies(
            (
                *((joints.link_position, self._at[:m]), (axes.position, self._at[m:])),
                *((joints.velocity, self._speed[:m]), (axes.velocity, self._speed[m:])),
            )
        )

    def _foresee(self, config: GiantConfig, robot: Robot) -> None:
        """The gantry and the joints, in the order of the model."""
        m, ppu, control = config.giant.manipulator, config.giant.ppu, self.force_control
        place, drift, rate = (np.zeros(robot.nv) for _ in range(3))
        axes, joints, k = self._axes, self._joints, len(PPU_JOINTS)
        self._locate = Copies(
            (
                *((axes.position, place[:k]), (joints.link_position, place[k:])),
                *((self._observer.qd, drift[:k]), (control.qd, drift[k:])),
                *((axes.target_velocity, rate[:k]), (control.qd, rate[k:])),
            )
        )
        lag = [ppu.time_constant + REACTION_S] * len(PPU_JOINTS)
        stop = Stop(
            drift,
            np.array([*lag, *[REACTION_S] * len(JOINTS)]),
            rate,
            np.array([*[ppu.acceleration] * len(PPU_JOINTS), *m.acceleration]),
            control.ability,
        )
        self._foresight = Foresight(
            config.look_ahead, robot, foreseen_limits(config), place, stop, boxes_of(config)
        )

    def _kalman_of(self, config: GiantConfig, manipulator: Robot, dt: float) -> InertialKalman | None:
        """The estimator of rotors and links, where it is asked for."""
        if config.giant.tracking.estimation != "kalman":
            return None
        imus, drives = self._imus, self._joints
        unit = imus.acceleration[HANDLE], imus.angular_velocity[HANDLE]
        measured = drives.position, drives.velocity, drives.link_position, drives.load_torque
        joints = joint_kalman(config, manipulator, measured, dt)
        return InertialKalman(joints, manipulator, "imu_handle", self._observer.qdd, unit)

    @property
    def ahead(self) -> str:
        """What the machine would have met if it went on; see ``Foreseeing``."""
        return self._foresight.ahead

    @property
    def pressed(self) -> str:
        """What the hand pushes together while the machine is held; see ``Foreseeing``."""
        return self._foresight.pressed

    @property
    def felt(self) -> Array:
        """Wrench of the operator that moves the twin, (6,) in B [N, N m]."""
        return self._rendering.felt

    @property
    def inside_limits(self) -> bool:
        """Whether the measured posture may be engaged."""
        return all(a.lower <= q <= a.upper for a, q in zip(self.axes, self.position, strict=True))

    def unrest(self, first: bool) -> list[str]:
        """Sensors that show at rest what they should not; later a hand may pull: its motors hold more."""
        if not (first or self._rendering.doubtful):
            return []
        found = pulled(self._estimator.wrench, self._force_torque.scales[0])
        for name, acceleration in zip(("carriage", "handle"), self._imus.acceleration.tolist(), strict=True):
            size = hypot(*acceleration)
            if not abs(size - GRAVITY) <= GRAVITY_MARGIN:
                found.append(f"the {name}'s accelerometer shows {size:.1f} m/s^2 at rest")
        self._rendering.doubtful &= bool(found)
        return found

    def estimate(self) -> None:
        """Measured axes, PPU observer and the operator's wrench."""
        imus = self._imus
        self._measured.update()
        self.position, self.velocity = self._at.tolist(), self._speed.tolist()
        self.inertial = imus.ready(CARRIAGE) and self._alive(self._carried)
        if self.inertial:  # otherwise the last sample stands
            self._acceleration[:] = self._carriage
        if not self._started:
            self._observer.reset()
            self._started = True
        self._observer.update()
        felt, held = self._alive(self._force), self._alive(self._held) and imus.ready(HANDLE)
        if felt and held and self._force_torque.ready(0):
            self.raw_wrench = self._raw.tolist()
            self._estimator.update()
        else:  # the last estimate stands, and is faded out
            self.raw_wrench = None
        if self.kalman:
            self.kalman.sensed = held and self.inertial
        if self.leading:
            self.leading.exchange()

    def _alive(self, sensor: Values) -> bool:
        return alive(sensor, self.velocity, self.thresholds)

    def engage(self) -> None:
        """Commanded state = measured link side, twin on the handle, everything at rest."""
        self._observer.reset()
        if self.leading:
            self.leading.engage()
        self._rendering.engage(self._joints.link_position, self._estimator.wrench)
        self._prepositioning.reset()
        self._base[:] = 0.0
        self._foresight.reset()
        self.solved = True

    def update(self, gain: float, trust: float) -> None:
        """One tick of HapticGiant, Fig. 4."""
        self._base[:] = self._observer.qdd
        self._standstill.reset()
        if self.leading:
            self.leading.drive(gain)
        self.solved = self._rendering.render(self._estimator.wrench, gain, trust, self._base)
        self.astray = self._rendering.astray + self._gantry_follows
        self.overload = self._rendering.overload
        self._prepositioning.update()
        self._announcer.update()
        self._locate.update()
        self._foresight.update()
        self._command(gain)
        self._rendering.advance()

    def brake(self, dropped: Sequence[bool]) -> bool:
        """Arm to rest within its limits while the PPU comes to rest at its own acceleration; then hold."""
        if self.leading:
            self.leading.rest()
        self._feed_base(dropped[len(JOINTS) :])
        carried = max(map(abs, self._observer.qd.tolist())) > PPU_STILL
        wrench = None if self.raw_wrench is None else self._estimator.wrench
        self._rendering.slow_down(self._base, wrench, carried, self.inertial and not any(dropped))
        self.astray = self._rendering.astray + self._gantry_follows
        self.overload = self._rendering.overload
        self._locate.update()
        self._foresight.hold()
        self._prepositioning.velocity[:] = self._axes.target_velocity
        self._prepositioning.stop()
        self._command(1.0)
        self._rendering.advance()
        commanded = self._rendering.still and not self._prepositioning.velocity.any()
        return self._standstill.update(self.plausibility.speed, dropped) and commanded

    def _feed_base(self, dropped: Sequence[bool]) -> None:
        """The gantry's acceleration for the feedforward of a stop, fading out where it is not measured."""
        if self.inertial and not any(dropped):
            self._base[:] = self._observer.qdd
        else:
            np.multiply(self._base, self._rendering.fade, out=self._base)

    def bind_state(self, state: NDArray[np.void]) -> None:
        """See ``state_layout``: its numbers come first and are copied in one go."""
        control, ppu, kalman = self.force_control, self._observer, self.kalman
        numbers = (
            *(self._joints.link_position, self._axes.position, control.q, control.qd, control.qdd),
            *(
                self._stiffness,
                *((kalman.link_rate, kalman.link_acceleration) if kalman else ()),
                self._used,
                *felt_beside(control),
                ppu.q,
                ppu.qd,
                ppu.qdd,
                *(self.leading.numbers if self.leading else ()),
            ),
        )
        self._log = StateLog(state, numbers, self._rendering)

    def fill(self) -> None:
        """Copy the state of this tick."""
        if self.leading:
            self.leading.fill()
        self._log.fill()

    def _command(self, gain: float) -> None:
        x, y = self._prepositioning.velocity.tolist()
        self.commands = [*self._rendering.torque(self._base), gain * x, gain * y]
