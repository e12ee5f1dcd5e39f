"""The giant between process image and gate: estimation, force control, prepositioning, tracking."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot, inf

import numpy as np
from numpy.typing import NDArray

from ...control.chain import Gains, Horizons, JointSum
from ...control.estimation import PpuObserver, WrenchEstimator
from ...control.force_control import Box, ForceControl
from ...control.limits import Limits
from ...control.prepositioning import PpuLimits, Prepositioning
from ...control.standstill import Standstill
from ...control.tracking import SeriesElasticity, Tracking
from ...control.twin import CartesianTwin
from ...devices.drive import AxisDrives, JointDrives
from ...devices.force_torque import ForceTorques
from ...devices.image import ProcessImage
from ...devices.imu import Imus
from ...models import Array, Robot
from ...safety import AxisLimits, Pairs, Plausibility, Thresholds, Values
from ..machine import DRIFT, GATE_SHARE, GRAVITY, GRAVITY_MARGIN, REST_S, SPEED_MARGIN
from ..measured import axes, sensor
from ..stages import Mark, Stage
from .config import GiantConfig
from .names import JOINTS, PPU_JOINTS

AT_REST = 1e-6
"""Commanded speeds below this are standstill [rad/s]."""
JOINTS_AT_REST, PPU_AT_REST = 0.25, 0.05
"""Measured speeds below these are standstill: a hand goes on pulling at the springs of joints that are held
[rad/s], and the gantry's inverters lag [m/s]."""
TILT = (0.0, 0.0, 0.0, 1.0, 1.0, 0.0)
"""Weights of the virtual sum joint q4 + q5 (14): the tilt of the handle."""
ELBOW = "joint_4"
"""The frame whose origin is the elbow."""
STOP_FADE_S = 5e-3
"""Time constant with which the operator's wrench leaves the feedforward of a stop, and the gantry's
acceleration where it is no longer measured."""
FEEDFORWARD_GAIN = 10.0
"""The feedforward of the operator's wrench fades in so many times as fast as the wrench itself."""
CONTRADICTION = 0.1
"""Part of a spring's deflection under the axis' largest torque by which its encoders and its torque sensor
may contradict each other (row 11): what such torque sensors are good for."""
CARRIAGE, HANDLE = 0, 1
"""The inertial units."""

STATE = np.dtype(
    [
        ("link", "<f8", 6),  # measured, link side [rad]
        ("axis", "<f8", 2),  # measured [m]
        ("q", "<f8", 6),  # commanded [rad]
        ("qd", "<f8", 6),
        ("qdd", "<f8", 6),
        ("ppu", "<f8", (3, 2)),  # estimated position, velocity, acceleration [m, s]
        ("wrench", "<f8", 6),  # of the operator, at the handle in B [N, N m]
        ("twin_position", "<f8", 3),
        ("twin_rotation", "<f8", (3, 3)),
        ("twin_twist", "<f8", 6),
        ("coupling", "<f8", 6),  # from handle to twin: translation [m] and rotation vector [rad] in B
        ("active", "u1", 19),  # flags of the limits of levels 2 to 8
        ("status", "i1"),
        ("iterations", "<u2"),
        ("solves", "u1"),
    ]
)


class Giant:
    """HapticGiant; see ``Machine``."""

    drive_groups: tuple[str, ...] = ("joints", "axes")
    state: np.dtype[np.void] = STATE

    def __init__(self, config: GiantConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        giant = config.giant
        dt = 1.0 / config.loop.rate
        self._mark = mark
        self._joints, self._axes = JointDrives(image), AxisDrives(image)
        self._force_torque, self._imus = ForceTorques(image), Imus(image)
        manipulator = robot.without(PPU_JOINTS)
        self._acceleration = np.zeros(2)
        self._observer = PpuObserver(dt, self._axes.position, self._acceleration)
        self.force_control = control = _force_control(config, manipulator, self._observer, dt)
        self._wrench, self._felt = np.zeros(6), np.zeros(6)
        self._estimator = WrenchEstimator(
            giant.handle.mass,
            np.array(giant.handle.centre),
            _sensor_pose(robot),
            self._force_torque.wrench[0],
            self._imus.acceleration[HANDLE],
            control.handle.rotation,
        )
        self._prepositioning = Prepositioning(
            giant.ppu.gain, _ppu_limits(config), dt, control.q, self._observer.q, self._observer.qd
        )
        self._tracking = Tracking(
            manipulator,
            control.arm,
            SeriesElasticity(np.array(giant.tracking.rotor_inertia), np.array(giant.tracking.stiffness)),
            np.array(giant.tracking.p_gain),
            np.array(giant.tracking.d_gain),
            {
                **{"q": control.q, "qd": control.qd, "qdd": control.qdd, "J": control.handle.J},
                **{
                    "wrench": self._wrench,
                    "motor": self._joints.position,
                    "motor_rate": self._joints.velocity,
                },
            },
        )
        self.axes = _axis_limits(config, robot, dt)
        self.thresholds = _thresholds(config, image)
        self.play = _play(config, self.axes)
        self._force = sensor(
            image, "force_torque", 0, self._force_torque.wrench[0], self._force_torque.scales[0], dt
        )
        self._carried, self._held = (
            sensor(image, "imus", i, self._imus.acceleration[i], [self._imus.scales[i]] * 3, dt)
            for i in (CARRIAGE, HANDLE)
        )
        self.plausibility = _plausibility(config, image, self.axes, (self._force, self._carried, self._held))
        self.position: list[float] = [0.0] * len(self.axes)
        self.velocity: list[float] = [0.0] * len(self.axes)
        self.raw_wrench: list[float] | None = None
        self.inertial = False
        self.braking = braking_time(config)
        self.commands: list[float] = [0.0] * len(self.axes)
        self.solved = True
        self._base = np.zeros(2)
        still = (JOINTS_AT_REST,) * len(JOINTS) + (PPU_AT_REST,) * len(PPU_JOINTS)
        self._standstill = Standstill(still, round(REST_S * config.loop.rate))
        self._fade = exp(-dt / STOP_FADE_S)
        self._started = False

    @property
    def inside_limits(self) -> bool:
        """Whether the measured posture may be engaged."""
        return all(a.lower <= q <= a.upper for a, q in zip(self.axes, self.position, strict=True))

    @property
    def unrest(self) -> list[str]:
        """Sensors that show at rest what they should not, each as a sentence for people."""
        found = []
        wrench, (force, *_, torque) = self._estimator.wrench.tolist(), self._force_torque.scales[0]
        if not (hypot(*wrench[:3]) <= DRIFT * force and hypot(*wrench[3:]) <= DRIFT * torque):
            measured = f"{hypot(*wrench[:3]):.1f} N and {hypot(*wrench[3:]):.2f} N m"
            found.append(f"the handle is pulled with {measured}; let go, or check the sensor and the tool")
        for name, acceleration in zip(("carriage", "handle"), self._imus.acceleration.tolist(), strict=True):
            size = hypot(*acceleration)
            if not abs(size - GRAVITY) <= GRAVITY_MARGIN:
                found.append(f"the {name}'s accelerometer shows {size:.1f} m/s^2 at rest")
        return found

    def estimate(self) -> None:
        """Measured axes, PPU observer and the operator's wrench."""
        joints, axes, imus = self._joints, self._axes, self._imus
        self.position = joints.link_position.tolist() + axes.position.tolist()
        self.velocity = joints.velocity.tolist() + axes.velocity.tolist()
        self.inertial = imus.valid(CARRIAGE) and self._carried.current
        if self.inertial:  # otherwise the last sample stands
            self._acceleration[:] = imus.acceleration[CARRIAGE, :2]
        if not self._started:
            self._observer.reset()
            self._started = True
        self._observer.update()
        current = self._force.current and self._held.current
        if current and self._force_torque.valid(0) and imus.valid(HANDLE):
            self.raw_wrench = self._force_torque.wrench[0].tolist()
            self._estimator.update()
        else:  # the last estimate stands, and is faded out
            self.raw_wrench = None

    def engage(self) -> None:
        """Commanded state = measured link side, twin on the handle, everything at rest."""
        self._observer.reset()
        self.force_control.reset(self._joints.link_position)  # even a little outside its limits: no jump
        self._tracking.reset()
        self._prepositioning.reset()
        self._base[:] = 0.0
        self.solved = True

    def update(self, gain: float, trust: float) -> None:
        """One tick of HapticGiant, Fig. 4."""
        control = self.force_control
        np.multiply(self._estimator.wrench, trust * gain, out=self._felt)
        np.multiply(self._estimator.wrench, trust * min(1.0, FEEDFORWARD_GAIN * gain), out=self._wrench)
        self._base[:] = self._observer.qdd
        self._standstill.reset()
        control.prepare(self._felt)
        self._mark(Stage.MODEL)
        regular = control.assemble()
        self._mark(Stage.ASSEMBLE)
        self.solved = regular and control.optimise()
        self._mark(Stage.SOLVE)
        if not regular:
            control.brake()
        self._prepositioning.update()
        self._command(gain)
        control.advance()

    def brake(self, dropped: Sequence[bool]) -> bool:
        """Joints to rest at their rated accelerations, the PPU at its own; then hold."""
        control = self.force_control
        np.multiply(self._wrench, self._fade, out=self._wrench)
        control.arm.update()
        control.brake()
        self._feed_base(dropped[len(JOINTS) :])
        self._prepositioning.velocity[:] = self._axes.target_velocity
        self._prepositioning.stop()
        self._command(1.0)
        control.advance()
        commanded = max(map(abs, control.qd.tolist())) < AT_REST and not self._prepositioning.velocity.any()
        return self._standstill.update(self.velocity, dropped) and commanded

    def _feed_base(self, dropped: Sequence[bool]) -> None:
        """The gantry's acceleration for the feedforward of a stop, fading out where it is not measured."""
        if self.inertial and not any(dropped):
            self._base[:] = self._observer.qdd
        else:
            np.multiply(self._base, self._fade, out=self._base)

    def write(self, admitted: Sequence[float]) -> None:
        """Torques to the joints, velocities to the PPU."""
        self._joints.target_torque[:] = admitted[: len(JOINTS)]
        self._axes.target_velocity[:] = admitted[len(JOINTS) :]

    def bind_state(self, state: NDArray[np.void]) -> None:
        """See STATE: its numbers come first and are copied in one go."""
        control, ppu, twin = self.force_control, self._observer, self.force_control.twin
        joints, axes = self._joints, self._axes
        self._numbers = (
            *(joints.link_position, axes.position, control.q, control.qd, control.qdd),
            *(ppu.q, ppu.qd, ppu.qdd, self._wrench),
            *(twin.position, twin.rotation.reshape(-1), twin.twist, control.coupling_error),
        )
        count = sum(len(numbers) for numbers in self._numbers)
        self._logged = state.view(np.uint8)[: 8 * count].view(np.float64)
        self._logged_solve = [state[name] for name in ("status", "iterations", "solves")]
        self._logged_active = state["active"][0]

    def fill(self) -> None:
        """Copy the state of this tick."""
        control = self.force_control
        np.concatenate(self._numbers, out=self._logged)
        self._logged_active[:] = control.active
        solve = (control.solution.status, control.iterations, control.solves)
        for field, value in zip(self._logged_solve, solve, strict=True):
            field[0] = value

    def _command(self, gain: float) -> None:
        torque = self._tracking.update(self._base)
        x, y = self._prepositioning.velocity.tolist()
        self.commands = [*torque.tolist(), gain * x, gain * y]


def braking_time(config: GiantConfig) -> float:
    """How long the slowest axis takes to brake from full speed [s]."""
    m, ppu = config.giant.manipulator, config.giant.ppu
    joints = max(v / a for v, a in zip(m.velocity, m.acceleration, strict=True))
    return max(joints, ppu.velocity / ppu.acceleration)


def _joint_limits(config: GiantConfig) -> Limits:
    m = config.giant.manipulator
    return Limits(np.array(m.lower), np.array(m.upper), np.array(m.velocity), np.array(m.acceleration))


def _ppu_limits(config: GiantConfig) -> PpuLimits:
    ppu = config.giant.ppu
    return PpuLimits(ppu.lower, ppu.upper, ppu.velocity, ppu.acceleration, ppu.time_constant)


def _force_control(config: GiantConfig, manipulator: Robot, ppu: PpuObserver, dt: float) -> ForceControl:
    giant = config.giant
    control, twin, tilt = giant.force_control, giant.twin, giant.manipulator.tilt
    return ForceControl(
        manipulator,
        _joint_limits(config),
        CartesianTwin(
            twin.mass,
            twin.inertia,
            twin.damping,
            twin.rotational_damping,
            (twin.velocity, twin.rotational_velocity),
            (twin.acceleration, twin.rotational_acceleration),
        ),
        [JointSum(TILT, tilt[0], tilt[1])],
        [Box(point, giant.box.lower, giant.box.upper) for point in ("handle", ELBOW)],
        Gains(control.p_gain, control.p_gain, control.d_gain, control.d_gain),
        control.detection,
        dt,
        Horizons(control.viability_horizon, control.point_horizon),
        ppu,
    )


def _sensor_pose(robot: Robot) -> Array:
    zero = np.zeros(robot.nv)
    T: Array = np.linalg.inv(robot.placement(zero, "handle")) @ robot.placement(zero, "force_torque")
    return T


def _axis_limits(config: GiantConfig, robot: Robot, dt: float) -> tuple[AxisLimits, ...]:
    manipulator, ppu, safety = config.giant.manipulator, config.giant.ppu, config.safety
    near, ppu_near = GATE_SHARE * safety.position_margin, GATE_SHARE * safety.ppu_margin
    effort = dict(zip(robot.names, robot.effort.tolist(), strict=True))
    joints = (
        AxisLimits(
            name=name,
            command=effort[name],
            step=inf,  # meeting a limit may take the whole torque at once; the drive limits the slew
            power=effort[name] * manipulator.velocity[i],
            lower=manipulator.lower[i] - near,
            upper=manipulator.upper[i] + near,
        )
        for i, name in enumerate(JOINTS)
    )
    axes = (
        AxisLimits(
            name=name,
            command=ppu.velocity,
            step=2.0 * ppu.acceleration * dt,
            power=inf,
            lower=ppu.lower[i] - ppu_near,
            upper=ppu.upper[i] + ppu_near,
        )
        for i, name in enumerate(PPU_JOINTS)
    )
    return (*joints, *axes)


def _play(config: GiantConfig, axes: Sequence[AxisLimits]) -> tuple[float, ...]:
    """What spring and position gain yield under a joint's whole torque; the gantry's margin."""
    tracking = config.giant.tracking
    gains = zip(tracking.stiffness, tracking.p_gain, strict=True)
    joints = (axis.command / k + axis.command / p for axis, (k, p) in zip(axes, gains, strict=False))
    return (*joints, *[config.safety.ppu_margin] * len(PPU_JOINTS))


def _plausibility(
    config: GiantConfig, image: ProcessImage, limits: Sequence[AxisLimits], sensors: Sequence[Values]
) -> Plausibility:
    giant, dt = config.giant, 1.0 / config.loop.rate
    joints, gantry = JointDrives(image), AxisDrives(image)
    effort = [limit.command for limit in limits[: len(JOINTS)]]
    compliance = [1.0 / k for k in giant.tracking.stiffness]
    yields = [CONTRADICTION * most * c for most, c in zip(effort, compliance, strict=True)]
    pairs = Pairs(joints.position, joints.link_position, joints.load_torque, compliance, yields)
    arm = axes(
        image,
        "joints",
        giant.manipulator.velocity,
        {"position": [0.0] * len(JOINTS), "link_position": yields},
        (joints.target_torque, effort, joints.load_torque),
        dt,
        [pairs],
    )
    base = axes(
        image,
        "axes",
        [giant.ppu.velocity] * len(PPU_JOINTS),
        {"position": [0.0] * len(PPU_JOINTS)},
        (gantry.target_velocity, [limit.command for limit in limits[len(JOINTS) :]], None),
        dt,
    )
    return Plausibility((arm, base), sensors)


def _thresholds(config: GiantConfig, image: ProcessImage) -> Thresholds:
    manipulator, ppu, safety = config.giant.manipulator, config.giant.ppu, config.safety
    margins = [safety.position_margin] * len(JOINTS) + [safety.ppu_margin] * 2
    lower, upper = (*manipulator.lower, *ppu.lower), (*manipulator.upper, *ppu.upper)
    speed = (*manipulator.velocity, ppu.velocity, ppu.velocity)
    return Thresholds(
        axes=(*JOINTS, *PPU_JOINTS),
        lower=tuple(low - margin for low, margin in zip(lower, margins, strict=True)),
        upper=tuple(high + margin for high, margin in zip(upper, margins, strict=True)),
        speed=tuple(SPEED_MARGIN * v for v in speed),
        devices=tuple(device.name for device in image.network.devices),
        rate=config.loop.rate,
        overruns_stop=config.loop.on_overrun == "stop",
    )
