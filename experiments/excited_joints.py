"""Joints of a simulated machine, excited on purpose, and what was measured of them meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
import pinocchio as pin

from ..control.excitation import Excitation, Room, design
from ..devices.image import ProcessImage
from ..devices.torque_drive import JointDrives
from ..models import Array, Robot
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.configuration.system import Led, Rig, find_system
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import Lockstep, unswept
from .identification import MOVING, Recorded
from .link_parameters import LinkFit, Links, fit_links
from .own_plant import Doubt
from .recorded_joints import Believed, IdentifyError, elastic
from .zero_phase import zero_phase

PACE = 0.7
"""Part of the joints' rated speeds and accelerations that a course uses: nobody holds the handle."""
TORQUE_SHARE = 0.6
"""Part of the motors' torques that a course asks for by the believed model: that may be wrong."""
WORST_CONDITION = 400.0
"""Condition number of a regressor with which errors of measurements drown the parameters."""
CUT_OFF_HZ = 20.0
"""Measured link positions are smoothed, without delay, before they are differentiated; loads likewise."""
LINK_RATE = 50
"""States a second that the links are identified from."""
EDGE_S = 0.2
"""Left out at both ends: smoothing and differences know one side only there."""
WAY, NEAR = 40, 0.3
"""Places on a way that are looked at; the first part may be as close to a limit as its beginning."""
STARTS_S = 10.0
"""The machine is up by then, or never."""


@dataclass(frozen=True, slots=True)
class Excited:
    """What was measured along a course.

    Attributes:
        joints: as they are believed, with what was recorded of each.
        course: that was led.
        condition: number of its regressor.
        links: model of what the springs carry.
        q: measured link side, (k, m) [rad or m]; load: measured, (k, m) [N m or N].
    """

    joints: list[tuple[Believed, list[Recorded]]]
    course: Excitation
    condition: float
    links: Links
    q: Array
    load: Array


def excite(
    loaded: Loaded,
    seconds: float,
    seed: int,
    doubt: Doubt,
    progress: Callable[[float, str], None] = lambda *_: None,
) -> Excited:
    """Lead all joints of a simulated machine along a course that tells its parameters apart.

    Args:
        loaded: its configuration.
        seconds: of the course.
        seed: of the course, and of what is doubted.
        doubt: how the machine differs from what its controller believes.
        progress: told the share that is done, and what happens.

    Raises:
        ConfigError: the configuration does not fit together.
        IdentifyError: the machine cannot be led, its limits leave no good course, or it stopped.
    """
    session = build(loaded)
    believed = elastic(loaded.config, session.robot)
    rig = _rig(loaded, session.robot)
    dt = 1.0 / loaded.config.loop.rate
    links = Links(rig.robot)
    progress(0.0, "choosing a course")
    found = design(
        *(rig.start, room(rig, believed), links.rows, seconds, seed, dt),
        lambda k, of: progress(0.3 * k / of, "choosing a course"),
    )
    course, number = _good(found)
    changed = doubt.vary(rig.config, seed)
    varied = Loaded(loaded.name, changed, loaded.text, loaded.source, loaded.model_text, loaded.model_source)
    rows = _record(Lockstep(build(varied, controller=rig.machine)), course, len(believed), progress)
    told, load, speed, motor, q = (np.ascontiguousarray(part) for part in np.moveaxis(rows, 1, 0))
    joints = [
        (joint, [Recorded(told[:, i], load[:, i], speed[:, i], motor[:, i] - q[:, i])])
        for i, joint in enumerate(believed)
    ]
    return Excited(joints, course, number, links, q, load)


def links_of(excited: Excited, dt: float) -> LinkFit:
    """What the loads along the course say of the links, in periods of dt [s]."""
    q, load = (
        np.column_stack([zero_phase(column, CUT_OFF_HZ, 1.0 / dt) for column in part.T])
        for part in (excited.q, excited.load)
    )
    qd = np.gradient(q, dt, axis=0)
    qdd = np.gradient(qd, dt, axis=0)
    edge = round(EDGE_S / dt)
    at = np.arange(edge, len(q) - edge, max(1, round(1.0 / (LINK_RATE * dt))))
    moving = MOVING * np.array([joint.speed for joint, _ in excited.joints])
    return fit_links(excited.links, q, qd, qdd, load, moving, at)


def room(rig: Rig[Any], believed: list[Believed]) -> Room:
    """Limits of the joints, and what sums, boxes and motors allow besides."""
    robot, rotor = rig.robot, np.array([joint.rotor_inertia for joint in believed])
    most = TORQUE_SHARE * np.array([joint.torque for joint in believed])

    def fits(q: Array, qd: Array, qdd: Array) -> bool:
        return all(map(rig.inside, q)) and all(
            bool((np.abs(_torque(robot, *row) + rotor * row[2]) <= most).all())
            for row in zip(q, qd, qdd, strict=True)
        )

    def reached(q: Array) -> bool:
        way = rig.start + np.linspace(0.0, 1.0, WAY)[:, None] * (q - rig.start)
        within = [rig.inside(place) for place in way]
        first = within.index(True) if True in within else WAY
        return first <= NEAR * WAY and all(within[first:])

    return Room(rig.lower, rig.upper, PACE * rig.velocity, PACE * rig.acceleration, reached, fits)


def _torque(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    torque: Array = pin.rnea(robot.model, robot.data, robot.configuration(q), qd, qdd)
    return torque


def _rig(loaded: Loaded, robot: Robot) -> Rig[Any]:
    kind = str(type(loaded.config).__struct_config__.tag)
    system = find_system(kind)
    if system.rig is None:
        raise IdentifyError(f"the joints of a machine of the kind {kind} cannot be led; give a recording")
    if loaded.config.simulation is None:
        raise IdentifyError("the configuration has no [simulation]; only a simulated machine is driven")
    rig: Rig[Any] = system.rig(loaded.config, robot)
    return rig


def _good(found: tuple[Excitation, float] | None) -> tuple[Excitation, float]:
    """The course, unless its parameters cannot be told apart."""
    if found is None or found[1] == inf:
        raise IdentifyError("no course fits between the limits of the joints from where they begin")
    if found[1] > WORST_CONDITION:
        raise IdentifyError(
            f"the best course has a condition number of {found[1]:.0f}, above {WORST_CONDITION:g}: limits,"
            " speeds or torques leave too little motion; widen them, begin elsewhere, or give more --seconds"
        )
    return found


def _record(lockstep: Lockstep, course: Excitation, m: int, progress: Callable[[float, str], None]) -> Array:
    """Commands, loads, speeds, motor and link positions of m joints along a course, (k, 5, m)."""
    cycle = lockstep.session.cycle
    led: Led = cycle.machine  # type: ignore[assignment]
    drives, image = JointDrives(cycle.image), cycle.image
    rate = lockstep.session.config.loop.rate
    with unswept():
        for _ in range(round((STARTS_S + lockstep.session.config.arming.fade) * rate)):
            _tick(lockstep)
            if lockstep.mode is Mode.ACTIVE:
                break
        else:
            raise IdentifyError(f"the machine did not start; it is {lockstep.mode.name}")
        led.go(course.centre)
        while not led.arrived:
            _tick(lockstep)
        led.follow(course)
        rows: list[Array] = []
        while not led.arrived:
            _tick(lockstep)
            rows.append(_measured(cycle.gate.admitted[:m], drives, image))
            if len(rows) % round(rate) == 0:
                progress(0.3 + 0.7 * len(rows) / rate / course.seconds, "leading the joints")
    return np.array(rows)


def _measured(admitted: Array, drives: JointDrives, image: ProcessImage) -> Array:
    return np.array([admitted, drives.load_torque, drives.velocity, drives.position, drives.link_position])


def _tick(lockstep: Lockstep) -> None:
    lockstep.tick()
    if lockstep.mode in (Mode.STOPPING, Mode.HOLDING, Mode.STOPPED, Mode.FAILED):
        said = [str(event) for event in lockstep.outputs.events] or [lockstep.mode.name]
        raise IdentifyError(f"the machine stopped: {'; '.join(said)}")
