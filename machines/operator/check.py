"""What an operator station's configuration, its model and its plant must agree in."""

from __future__ import annotations

from ...control.cue import LEAST_RATE
from ...devices.buttons import Buttons
from ...devices.device import Device
from ...devices.foot_paddle import FootPaddle
from ...devices.head_tracker import HeadTracker
from ...devices.remote_avatar import RemoteAvatar
from ...devices.remote_body import RemoteBody
from ...devices.remote_hand import RemoteHand
from ...devices.sense_glove import SenseGlove
from ...models import Robot
from ..rendering.check import Found
from ..telemanipulation.arm import SIDES
from ..telemanipulation.check import check_chain, check_station
from .config import OperatorConfig


def check_operator(config: OperatorConfig, robot: Robot) -> Found:
    """What only the model can tell: key, problem, fix."""
    own = config.operator
    others: dict[str, type[Device]] = {
        **{f"{side}_avatar": RemoteAvatar for side in SIDES},
        "buttons": Buttons,
    }
    if own.gloves is not None:
        others |= {f"{side}_glove": SenseGlove for side in SIDES}
        others |= {f"{side}_hand": RemoteHand for side in SIDES}
    if own.body:
        others |= {"head": HeadTracker, "paddle": FootPaddle, "body": RemoteBody}
    found = check_station("operator", config, own, config.simulation, robot, others)
    found += _presses(config)
    if own.cue.force and config.loop.rate < LEAST_RATE:
        problem = f"at {config.loop.rate:g} Hz the operator's cues are not told apart"
        fix = f'give {LEAST_RATE:g} Hz or more, or no cues: operator.cue.force = "0 N"'
        found.append(("loop.rate", problem, fix))
    if own.avatar is None:
        return found
    for side in SIDES:
        key, chain = f"operator.avatar.{side}", getattr(own.avatar, side)
        found += check_chain(key, chain, robot)
    return found


def _presses(config: OperatorConfig) -> Found:
    """Buttons that are let go of before they are pressed."""
    presses = (config.simulation and config.simulation.buttons) or ()
    return [
        (
            f"simulation.buttons[{i}].until",
            f"{push.until:g} s is not after {push.at:g} s",
            "give a later time",
        )
        for i, push in enumerate(presses)
        if push.until <= push.at
    ]
