"""The parts that a giant is put together from, as its configuration has them."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from ...control.chain import Gains, Horizons, JointSum
from ...control.chain_twin import ChainTwin
from ...control.estimation import PpuObserver
from ...control.force_control import Box, ForceControl
from ...control.joint_kalman import JointKalman, link_inertia
from ...control.limits import Limits
from ...control.tracking import SLOW, DriveFriction
from ...devices.axis_drive import AxisDrives
from ...devices.force_torque import ForceTorques
from ...devices.image import ProcessImage
from ...devices.imu import Imus
from ...models import Array, Robot
from ...runtime.core.machine import GATE_SHARE
from ...runtime.core.measured import axes, sensor
from ...runtime.core.torque_axes import TorqueAxes, peaks_of, thresholds
from ...safety import AxisLimits, Heat, Plausibility, Thresholds, Values
from ..rendering.giving_way import compliance_of
from ..rendering.ratings import Ratings
from ..rendering.sections import ChainTwin as ChainSection
from ..rendering.twin import twin_of
from ..telemanipulation.leading_twin import LeadingTwin
from .config import GiantConfig
from .names import JOINTS, PPU_JOINTS
from .prepositioning import PpuLimits, Prepositioning

TILT = (0.0, 0.0, 0.0, 1.0, 1.0, 0.0)
"""Weights of the virtual sum joint q4 + q5 (14): the tilt of the handle."""
PLANNED_SPEED = 0.95
"""Of a joint's top speed so much is planned with: its link swings about that on its spring, and beyond 1.1
times the top speed the machine stops."""
ELBOW = "joint_4"
"""The frame whose origin is the elbow."""
CARRIAGE, HANDLE = 0, 1
"""The inertial units."""


def foreseen_limits(config: GiantConfig) -> tuple[Array, Array]:
    """Lower and upper limits of gantry and joints, in the order of the model, (8,) each [m, rad]."""
    m, ppu = config.giant.manipulator, config.giant.ppu
    return np.array([*ppu.lower, *m.lower]), np.array([*ppu.upper, *m.upper])


def braking_time(config: GiantConfig) -> float:
    """How long the slowest axis takes to brake from full speed [s]."""
    m, ppu = config.giant.manipulator, config.giant.ppu
    joints = max(v / a for v, a in zip(m.velocity, m.acceleration, strict=True))
    return max(joints, ppu.velocity / ppu.acceleration)


def ratings_of(config: GiantConfig, robot: Robot) -> Ratings:
    """What the joints' drives can do."""
    m, tracking = config.giant.manipulator, config.giant.tracking
    effort = dict(zip(robot.names, robot.effort.tolist(), strict=True))
    torque = [effort[name] for name in JOINTS]
    axes = TorqueAxes(
        *(JOINTS, m.lower, m.upper, m.velocity, torque, tracking.stiffness),
        rotor=tracking.rotor_inertia,
        doubt=tracking.stiffness_tolerance,
        peaks=peaks_of(config.devices, JOINTS),
    )
    return Ratings(axes, tracking.stiffness, m.acceleration, tracking.p_gain)


def drive_friction(config: GiantConfig) -> DriveFriction:
    """What is fed forward of the joints' friction."""
    tracking = config.giant.tracking

    def given(values: tuple[float, ...] | None) -> Array:
        return np.zeros(len(JOINTS)) if values is None else np.array(values)

    return DriveFriction(
        gear=given(tracking.gear_friction),
        damping=given(tracking.gear_damping),
        share=given(tracking.load_friction),
        bearing=given(tracking.bearing_friction),
        slow=SLOW * np.array(config.giant.manipulator.velocity),
    )


def leading_twin(
    config: GiantConfig, control: ForceControl, image: ProcessImage, notes: list[str], dt: float
) -> LeadingTwin | None:
    """What lets the twin lead an avatar's arm, where it does."""
    if config.leads is None:
        return None
    section, twin = config.giant.twin, control.twin
    assert isinstance(section, ChainSection) and isinstance(twin, ChainTwin)
    return LeadingTwin(config.leads, section, twin, image, notes, dt)


def joint_kalman(
    config: GiantConfig, manipulator: Robot, measured: tuple[Array, Array, Array, Array], dt: float
) -> JointKalman:
    """Filters of the joints, which read motors' angles and speeds, links' angles, springs' torques, (6,)."""
    tracking, m = config.giant.tracking, config.giant.manipulator
    middle = np.mean(np.clip([m.lower, m.upper], -np.pi, np.pi), axis=0)
    return JointKalman(
        np.array(tracking.rotor_inertia),
        np.array(tracking.stiffness),
        link_inertia(manipulator, middle),
        manipulator.effort,
        np.array(m.acceleration),
        measured,
        dt,
    )


def ppu_limits(config: GiantConfig) -> PpuLimits:
    """Limits of the gantry."""
    ppu = config.giant.ppu
    return PpuLimits(ppu.lower, ppu.upper, ppu.velocity, ppu.acceleration, ppu.time_constant)


def force_control_of(
    config: GiantConfig, manipulator: Robot, ppu: PpuObserver, ratings: Ratings, dt: float
) -> ForceControl:
    """The hierarchical force control, of the manipulator on its gantry."""
    giant = config.giant
    control, m, tracking = giant.force_control, giant.manipulator, giant.tracking
    speeds = PLANNED_SPEED * np.array(m.velocity)
    limits = Limits(np.array(m.lower), np.array(m.upper), speeds, np.array(m.acceleration))
    yielding = 1.0 / np.array(tracking.p_gain) + 1.0 / np.array(tracking.stiffness)
    return ForceControl(
        manipulator,
        limits,
        [twin_of(twin) for twin in config.twins.values()],
        [JointSum(TILT, *m.tilt)],
        boxes_of(config),
        Gains(control.p_gain, control.p_gain, control.d_gain, control.d_gain),
        control.detection,
        dt,
        Horizons(control.viability_horizon, control.point_horizon),
        ppu,
        limited=control.detection == "gauss",
        compliance=compliance_of(config.compliance, ratings.axes.torque, limits, yielding),
    )


def boxes_of(config: GiantConfig) -> list[Box]:
    """Where handle and elbow stay."""
    box = config.giant.box
    return [Box(point, box.lower, box.upper) for point in ("handle", ELBOW)]


def gantry_limits(config: GiantConfig, dt: float) -> tuple[AxisLimits, ...]:
    """What a command to the gantry is held to."""
    ppu, near = config.giant.ppu, GATE_SHARE * config.safety.ppu_margin
    return tuple(
        AxisLimits(
            name=name,
            command=ppu.velocity,
            step=2.0 * ppu.acceleration * dt,
            power=inf,
            lower=ppu.lower[i] - near,
            upper=ppu.upper[i] + near,
        )
        for i, name in enumerate(PPU_JOINTS)
    )


def plausibility_of(
    config: GiantConfig,
    image: ProcessImage,
    ratings: Ratings,
    stiffness: Array,
    heat: Heat,
    sensors: Sequence[Values],
) -> Plausibility:
    """What sensors and drives say is held against what they can mean."""
    speed, dt = [config.giant.ppu.velocity] * len(PPU_JOINTS), 1.0 / config.loop.rate
    told = AxisDrives(image).target_velocity
    gantry = axes(image, "axes", speed, {"position": [0.0] * len(PPU_JOINTS)}, (told, speed, None), dt)
    return Plausibility((ratings.axes.checks(config, image, stiffness=stiffness, heat=heat), gantry), sensors)


def thresholds_of(config: GiantConfig, image: ProcessImage, swing: Sequence[float]) -> Thresholds:
    """Where the axes are, at the latest, stopped."""
    manipulator, ppu, safety = config.giant.manipulator, config.giant.ppu, config.safety
    margins = [safety.position_margin] * len(JOINTS) + [safety.ppu_margin] * len(PPU_JOINTS)
    ranges = (*manipulator.lower, *ppu.lower), (*manipulator.upper, *ppu.upper)
    speed = (*manipulator.velocity, *[ppu.velocity] * len(PPU_JOINTS))
    return thresholds(config, image, (*JOINTS, *PPU_JOINTS), ranges, margins, speed, (*swing, 0.0, 0.0))


def prepositioning_of(config: GiantConfig, q: Array, ppu: PpuObserver, dt: float) -> Prepositioning:
    """What leads the gantry after joints at q."""
    m, box = config.giant.manipulator, config.giant.box
    return Prepositioning(
        config.giant.ppu.gain,
        ppu_limits(config),
        (m.lower[1:3], m.upper[1:3]),
        (box.lower, box.upper),
        *(dt, q, ppu.q, ppu.qd),
    )


def sensed(
    image: ProcessImage, wrench: ForceTorques, raw: Array, imus: Imus, dt: float
) -> tuple[Values, Values, Values]:
    """The force-torque sensor and the inertial units of carriage and handle, as plausibility sees them."""
    force = sensor(image, "force_torque", 0, raw, wrench.scales[0], dt)
    carried, held = (
        sensor(image, "imus", i, imus.acceleration[i], [imus.scales[i]] * 3, dt) for i in (CARRIAGE, HANDLE)
    )
    return force, carried, held
