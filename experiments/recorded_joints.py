"""What a recording says of each joint with a spring, and what its controller believed of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..devices.errors import FrameError
from ..devices.image import ProcessImage
from ..devices.torque_drive import JointDrives
from ..machines.arm.config import ArmConfig
from ..machines.giant.config import GiantConfig
from ..machines.giant.names import JOINTS
from ..models import Array, Robot
from ..runtime.configuration.session import build
from ..runtime.core.modes import RENDERING
from ..runtime.core.sections import Config
from ..runtime.core.tick import Inputs
from ..runtime.errors import HapticdError
from ..runtime.recording.log import Log
from .identification import WINDOW, Recorded


class IdentifyError(HapticdError):
    """A recording from which nothing can be identified."""

    code = "identify"
    exit_status = 2


@dataclass(frozen=True, slots=True)
class Believed:
    """A joint as its controller knows it: inertia, stiffness, top speed, largest torque.

    What slides has kg, N/m, m/s and N. ``friction`` is what its controller feeds forward, by the keys of the
    configuration.
    """

    name: str
    rotor_inertia: float
    stiffness: float
    speed: float
    torque: float
    slides: bool
    friction: Mapping[str, float]


FRICTION = ("gear_friction", "gear_damping", "load_friction", "bearing_friction")
"""Keys of a configuration."""


def recorded(log: Log) -> list[tuple[Believed, list[Recorded]]]:
    """Each joint, and what was recorded of it while the machine rendered, in runs without gaps.

    Raises:
        IdentifyError: the machine has no springs, or never rendered for a while.
        LogError: the recording is damaged.
    """
    session = build(log.loaded, runs=False)
    joints = elastic(log.loaded.config, session.robot)
    runs = [np.array(run) for run in _runs(log, session.cycle.image, len(joints))]
    if not runs:
        raise IdentifyError(f"{log.path}: nothing was moved in it; record a session in which joints move")
    return [
        (joint, [Recorded(*np.ascontiguousarray(run[:, :, i].T)) for run in runs])
        for i, joint in enumerate(joints)
    ]


def elastic(config: Config, robot: Robot) -> list[Believed]:
    """The joints of a machine as its controller knows them.

    Raises:
        IdentifyError: it has no springs.
    """
    known = zip(robot.names, robot.effort.tolist(), robot.sliding, strict=True)
    limits = {name: (effort, bool(slides)) for name, effort, slides in known}
    rows = zip(_elastic(config), _rubbing(config), strict=True)
    return [Believed(*row, *limits[row[0]], friction) for row, friction in rows]


def _rubbing(config: Config) -> list[dict[str, float]]:
    if isinstance(config, GiantConfig):
        given = [getattr(config.giant.tracking, key) or (0.0,) * len(JOINTS) for key in FRICTION]
        return [dict(zip(FRICTION, values, strict=True)) for values in zip(*given, strict=True)]
    assert isinstance(config, ArmConfig)
    joints = [joint for joint in config.arm.joints.values() if joint.stiffness is not None]
    return [{key: getattr(joint, key) or 0.0 for key in FRICTION} for joint in joints]


def _elastic(config: Config) -> list[tuple[str, float, float, float]]:
    if isinstance(config, GiantConfig):
        tracking, m = config.giant.tracking, config.giant.manipulator
        return list(zip(JOINTS, tracking.rotor_inertia, tracking.stiffness, m.velocity, strict=True))
    if isinstance(config, ArmConfig):
        joints = config.arm.joints.items()
        found = [(name, j.rotor_inertia, j.stiffness, j.velocity) for name, j in joints]
        springs: list[tuple[str, float, float, float]] = [
            (name, rotor, k, speed) for name, rotor, k, speed in found if k is not None
        ]
        if springs:
            return springs
    raise IdentifyError(
        "no joint of this machine has a spring: there is no stiffness to identify; with its configuration and"
        " --handle its simulated handle is pushed instead"
    )


def _runs(log: Log, image: ProcessImage, n: int) -> list[list[Array]]:
    """Ticks (4, n) in a row: commands, loads, speeds, deflections."""
    drives, inputs, counter = JointDrives(image), Inputs(), 0
    runs: list[list[Array]] = [[]]
    for record in log.records():
        fixed = record.fixed
        try:
            inputs.frames.unpack(record.frames_in)
        except FrameError:
            inputs.frames.clear()
        heard = image.latch(inputs.frames, counter)
        counter = int(fixed["tick"])
        if heard == image.expected and not fixed["skipped"] and int(fixed["mode"]) in RENDERING:
            deflection = drives.position - drives.link_position
            runs[-1].append(
                np.array([fixed["admitted"][:n], drives.load_torque, drives.velocity, deflection])
            )
        elif runs[-1]:
            runs.append([])
    return [run for run in runs if len(run) > 2 * WINDOW]
