"""What an avatar's configuration, its model and its plant must agree in."""

from __future__ import annotations

from ...configs.words import meant
from ...devices.base_drive import BaseDrive
from ...devices.device import Device
from ...devices.neck_arm import NeckArm
from ...devices.remote import MOST_DRIVES
from ...devices.remote_glove import RemoteGlove
from ...devices.remote_operator import RemoteOperator
from ...devices.remote_pilot import RemotePilot
from ...devices.robot_hand import RobotHand
from ...devices.sense_glove import GLOVE_JOINTS
from ...models import Robot
from ..rendering.check import Found
from ..telemanipulation.arm import SIDES
from ..telemanipulation.check import check_station
from .config import AvatarConfig
from .config import RobotHand as Section


def check_avatar(config: AvatarConfig, robot: Robot) -> Found:
    """What only the model can tell: key, problem, fix."""
    others: dict[str, type[Device]] = {f"{side}_operator": RemoteOperator for side in SIDES}
    own = config.avatar.hands
    if own is not None:
        others |= {f"{side}_hand": RobotHand for side in SIDES}
        others |= {f"{side}_glove": RemoteGlove for side in SIDES}
    if config.avatar.body is not None:
        others |= {"neck": NeckArm, "base": BaseDrive, "pilot": RemotePilot}
    found = check_station("avatar", config, config.avatar, config.simulation, robot, others)
    if found:
        return found
    for side in SIDES if own else ():
        found += _hand(f"avatar.hands.{side}", getattr(own, side), config.devices[f"{side}_hand"])
    simulation = config.simulation
    for i, wall in enumerate((simulation.walls if simulation else None) or ()):
        if not any(wall.normal):
            found.append((f"simulation.walls[{i}].normal", "points nowhere", "give it a length"))
    return found


def _hand(key: str, section: Section, device: RobotHand) -> Found:
    """A map that is not of this hand, or not of a glove."""
    if list(section.drives) != list(device.drives) or len(device.drives) > MOST_DRIVES:
        problem = f"is not one table for each drive of {device.name}"
        return [(f"{key}.drives", problem, f"give {', '.join(device.drives)}, in this order")]
    found: Found = []
    for name, drive in section.drives.items():
        if not drive.lower < drive.upper:
            problem = f"{drive.lower:g} is not below {drive.upper:g}"
            found.append((f"{key}.drives.{name}.lower", problem, "mend it"))
        for joint in drive.follows:
            if joint not in GLOVE_JOINTS:
                problem = f"a glove has no joint '{joint}'"
                found.append((f"{key}.drives.{name}.follows", problem, meant(joint, GLOVE_JOINTS)))
    return found
