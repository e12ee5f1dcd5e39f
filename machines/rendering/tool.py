"""What hangs on a force-torque sensor: by the configuration, by a calibration, or in truth."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from ...configs.quantities import HandleMass, Lengths3
from ...control.ft_calibration import Tool
from ...devices.device import Device
from ...devices.force_torque import ForceTorque
from ...models import Robot
from .check import Found, check_handle
from .rendering import sensor_pose
from .sections import Handle


def tool_of(handle: Handle | None, sensor: Device) -> Tool:
    """What the controller takes off the readings: as calibrated, or as configured, then without a bias."""
    assert isinstance(sensor, ForceTorque)
    if sensor.kept is not None:
        kept = sensor.kept
        return Tool(np.array([*kept.force_bias, *kept.torque_bias]), kept.mass, np.array(kept.centre))
    assert handle is not None, "check_tool requires one of both"
    return Tool(np.zeros(6), handle.mass, np.array(handle.centre))


def carrying(robot: Robot, frame: str, mount: str, sensor: Device, handle: Handle | None) -> Robot:
    """The model of a robot with the handle as it was calibrated: its weight is compensated as it is.

    Args:
        robot: its model.
        frame: link that hangs on the sensor.
        mount: frame of the sensor.
        sensor: the device; without a calibration the model stays as it is.
        handle: of the configuration.
    """
    if not (isinstance(sensor, ForceTorque) and sensor.kept is not None):
        return robot
    tool, frames = tool_of(handle, sensor), robot.model.frames
    body = frames[frames[robot.frame(frame)].parentFrame].inertia
    at_joint, joint = frames[robot.frame(frame)].placement, frames[robot.frame(frame)].parentJoint
    T = sensor_pose(robot, frame, mount)
    centre = T[:3, :3] @ tool.centre + T[:3, 3]
    # its inertia about the centre is not measured: that of the model, in proportion to the mass
    own = pin.Inertia(tool.mass, centre, body.inertia * (tool.mass / body.mass))
    model = robot.model.copy()
    model.inertias[joint] = model.inertias[joint] - at_joint.act(body) + at_joint.act(own)
    found = Robot(model)
    found.damping = robot.damping.copy()
    return found


def own_handle(handle: Handle | None, robot: Robot, frame: str, mount: str) -> Handle:
    """What hangs on a simulated sensor: as configured, or what the model has where it was calibrated."""
    if handle is not None:
        return handle
    frames = robot.model.frames
    body = frames[frames[robot.frame(frame)].parentFrame].inertia
    T = np.linalg.inv(sensor_pose(robot, frame, mount))
    centre = T[:3, :3] @ body.lever + T[:3, 3]
    return Handle(HandleMass(body.mass), Lengths3(centre.tolist()))


def check_tool(
    handle: Handle | None,
    devices: Mapping[str, Device],
    robot: Robot,
    frames: tuple[str, str],
    keys: tuple[str, str],
) -> Found:
    """What hangs on a sensor must be said once: configured, near to what the model has, or calibrated.

    Args:
        handle: of the configuration.
        devices: of the machine.
        robot: its model.
        frames: of handle and sensor.
        keys: of the handle's section, and name of the sensor among the devices.
    """
    section, name = keys
    sensor = devices.get(name)
    calibrated = isinstance(sensor, ForceTorque) and sensor.kept is not None
    if handle is None:
        fix = f"give mass and centre, or devices.{name}.calibration: hapticd calibrate ft"
        return [] if calibrated else [(section, "is missing", fix)]
    if calibrated:
        problem = f"says mass and centre a second time: devices.{name}.calibration has them"
        return [(section, problem, "remove one of both")]
    return check_handle(handle, robot, *frames, section)
