"""Contact over a link in six dimensions: a finger beside the palm meets the wall, which turns the hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..control.avatar_law import Impedance
from ..control.link_passivity import AvatarPort, OperatorPort
from ..models import Array
from .contact_over_link import DT, Network, Press, Pressed, Way, pressed

FINGER = np.array([0.08, 0.05, 0.0])
"""From the palm, in its axes [m]."""
RUB = 20.0
"""Viscous friction along the wall [N s/m]."""
TURN_STIFFNESS, TURN_DAMPING, INERTIA = 8.0, 0.5, 0.04
"""Of the hand's grip about its axes, and of either arm at its palm [N m/rad], [N m s/rad], [kg m^2]."""
SHARE = 1.0 - float(np.exp(-2.0 * np.pi * 15.0 * DT))
"""Of the sensor's low-pass in a tick."""


@dataclass
class Body:
    """An arm at its palm.

    Attributes:
        mass: [kg]; position: (3,) [m]; rotation: (3, 3); twist: (6,), all in the station's axes.
    """

    mass: float
    position: Array
    rotation: Array
    twist: Array

    def push(self, wrench: Array) -> Array:
        """Move on for a tick; the mean twist of it, (6,)."""
        before = self.twist.copy()
        self.twist[:3] += DT * wrench[:3] / self.mass
        self.twist[3:] += DT * wrench[3:] / INERTIA
        self.position[:] += DT * self.twist[:3]
        self.rotation[:] = pin.exp3(DT * self.twist[3:]) @ self.rotation
        mean: Array = 0.5 * (before + self.twist)
        return mean


def spring(body: Body, position: Array, rotation: Array, stiffness: tuple[float, float]) -> Array:
    """Wrench that draws a body to a pose, (6,)."""
    turn = pin.log3(rotation @ body.rotation.T)
    return np.concatenate([stiffness[0] * (position - body.position), stiffness[1] * turn])


def touch(case: Press, body: Body) -> Array:
    """Wrench of the wall at x = 0 on the palm, (6,)."""
    arm = body.rotation @ FINGER
    deep = float(body.position[0] + arm[0])
    if deep <= 0.0:
        return np.zeros(6)
    v = body.twist[:3] + np.cross(body.twist[3:], arm)
    force = -RUB * v
    force[0] = min(0.0, -case.wall * deep - case.wall_damping * float(v[0]))
    return np.concatenate([force, np.cross(arm, force)])


def press_in_space(
    case: Press, there: Network, back: Network, seconds: float, seed: int, layer: bool
) -> Pressed:
    """As ``press``, with palms that move and turn in space; places are along x, the work is of all six."""
    ticks = round(seconds / DT)
    out, home = (Way(n, ticks, [seed, k]).newest for k, n in enumerate((there, back)))
    k = Impedance()
    S = k.stiffness, k.rotational_stiffness
    D = np.repeat([k.damping, k.rotational_damping], 3)
    grip = np.repeat([case.hand_damping, TURN_DAMPING], 3)
    reach = -float(FINGER[0])
    start = np.array([case.wanted(0.0)[0] + reach, 0.0, 0.0])
    hand = Body(case.mass, start.copy(), np.eye(3), np.zeros(6))
    arm = Body(case.avatar, start.copy(), np.eye(3), np.zeros(6))
    sensed, felt_there = np.zeros(6), np.zeros(6)
    operator = OperatorPort(hand.rotation, hand.twist, DT)
    avatar = AvatarPort(arm.rotation, arm.twist, sensed, k, DT)
    avatar.position[:] = start
    avatar.reset()
    poses, wrenches = [(start.copy(), np.eye(3))], [np.zeros(6)]
    granted, returned, given, work, rows = [0.0], [0.0], 0.0, 0.0, []
    for i in range(ticks):
        avatar.position[:], avatar.rotation[:] = poses[out[i] + 1]
        sensed[:3], sensed[3:] = arm.rotation.T @ felt_there[:3], arm.rotation.T @ felt_there[3:]
        avatar.update(granted[out[i] + 1])
        goal = (avatar.reference, avatar.reference_rotation) if layer else poses[out[i] + 1]
        operator.wrench[:] = wrenches[home[i] + 1]
        operator.update(returned[home[i] + 1])
        felt = operator.felt if layer else operator.wrench
        felt = np.concatenate([hand.rotation @ felt[:3], hand.rotation @ felt[3:]])
        wanted, rate = case.wanted(i * DT)
        pull = spring(hand, np.array([wanted + reach, 0.0, 0.0]), np.eye(3), (case.hand, TURN_STIFFNESS))
        pull -= grip * (hand.twist - [rate, 0.0, 0.0, 0.0, 0.0, 0.0])
        work += DT * abs(float(pull @ hand.twist))
        given += DT * float(felt @ hand.push(pull + felt))
        wall = touch(case, arm)
        given -= DT * float(wall @ arm.push(spring(arm, goal[0], goal[1], S) - D * arm.twist + wall))
        felt_there += SHARE * (wall - felt_there)
        poses.append((hand.position.copy(), hand.rotation.copy()))
        wrenches.append(sensed.copy())
        granted.append(operator.sent)
        returned.append(avatar.sent)
        places = float(hand.position[0]) - reach, float(arm.position[0]) - reach
        levels = operator.level, avatar.level
        rows.append((i * DT, *places, felt[0], wall[0], given, operator.taken, *levels))
    table = np.array(rows)
    return pressed(table, work)
