"""What the configuration of a machine whose twin leads an avatar's arm, and its twin, must agree in."""

from __future__ import annotations

from ...devices.device import Device
from ...devices.remote_avatar import RemoteAvatar
from ...models import Robot
from ..rendering.check import Found
from ..rendering.sections import Arm, ChainTwin, Twin
from ..rendering.twin import limits_of, robot_of
from .arm import SIDES
from .check import check_chain
from .sections import Chain, Leads

HELD = 150.0, 20.0
"""No hand holds more [N, N m]; it need not be given more of what an avatar feels."""


def gateways(leads: Leads | None) -> dict[str, type[Device]]:
    """The devices that it needs for that."""
    return {} if leads is None else {f"{side}_avatar": RemoteAvatar for side in SIDES}


def check_leads(leads: Leads | None, machine: str, twin: Twin) -> Found:
    """A twin that is not the arm that it leads: key, problem, fix.

    Args:
        leads: whom; None: nobody.
        machine: its kind.
        twin: which is fine by itself.
    """
    if leads is None:
        return []
    at, chain = f"{machine}.twin", getattr(leads, leads.side)
    if not isinstance(twin, ChainTwin) or twin.arm is None or twin.kept is None or twin.urdf is None:
        return [(at, "is no arm of an avatar", 'give kind = "chain", the urdf of the avatar, and arm')]
    whole = Robot.from_urdf(twin.kept.urdf, twin.urdf)
    found = [each for side in SIDES for each in check_chain(f"leads.{side}", getattr(leads, side), whole)]
    for key, most, unit in (("force", HELD[0], "N"), ("torque", HELD[1], "N m")):
        if (given := getattr(leads.most, key)) > most:
            problem = f"no hand holds {given:g} {unit}"
            found.append((f"leads.most.{key}", problem, f"give at most {most:g} {unit}"))
    return found or _same(at, f"leads.{leads.side}", twin, chain) or _within(at, twin, chain)


def _same(at: str, led: str, twin: ChainTwin, chain: Chain) -> Found:
    assert twin.arm is not None
    found: Found = []
    for name in Arm.__struct_fields__:
        own, there = getattr(twin.arm, name), getattr(chain, name)
        if own != there:
            found.append((f"{at}.arm.{name}", f"is not that of {led}", "let them agree"))
    for (name, joint), home in zip(twin.joints.items(), chain.home, strict=True):
        if joint.start != home:
            problem = f"{joint.start:g} is not the home of {led}, {home:g}"
            found.append((f"{at}.joints.{name}.start", problem, "let them agree"))
    return found


def _within(at: str, twin: ChainTwin, chain: Chain) -> Found:
    """Limits of the twin beyond those of the arm, at which the arm would not follow."""
    lower, upper, velocity, _ = limits_of(twin, robot_of(twin))
    found: Found = []
    for i, name in enumerate(twin.joints):
        key = f"{at}.joints.{name}"
        if lower[i] < chain.lower[i] or upper[i] > chain.upper[i]:
            problem = (
                f"{lower[i]:g} to {upper[i]:g} leaves the arm's {chain.lower[i]:g} to {chain.upper[i]:g}"
            )
            found.append((f"{key}.range", problem, "stay within it, a little inside"))
        if velocity[i] > chain.velocity[i]:
            problem = f"{velocity[i]:g} is faster than the arm's {chain.velocity[i]:g}"
            found.append((f"{key}.velocity", problem, "lower it"))
    return found
