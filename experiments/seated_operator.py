"""A seated person's left arm: 7 joints with limits, and the poses of the hand that a session takes it to.

Synthetic, in place of poses recorded from a person (Bimanual, V-A): half of them near a posture in which one
works in front of oneself, a quarter there with the hand turned about, the rest anywhere the joints allow in
front of the body, the stretched arm among it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..models import Array

COUNT = 2959
"""Of the paper's poses."""
SHOULDER = np.array([0.0, 0.19, 0.0])
"""In the person's frame: x forward, y to the left, z up, the origin between the shoulders [m]."""
UPPER, FORE, HAND = 0.30, 0.26, 0.08
"""Of upper arm and forearm, and from wrist to the middle of the palm [m]."""
LOWER = np.radians([-5.0, -10.0, -30.0, 5.0, -70.0, -40.0, -15.0])
HIGHER = np.radians([70.0, 110.0, 60.0, 130.0, 70.0, 40.0, 20.0])
"""Abduction, flexion and rotation of the shoulder, flexion of the elbow, pronation, flexion and deviation of
the wrist [rad]."""
WORK = np.radians([15.0, 30.0, 15.0, 75.0, 0.0, 0.0, 0.0])
WIDTH = np.radians([12.0, 18.0, 15.0, 20.0, 20.0, 12.0, 6.0])
"""The posture in which one works, and how far it is from that usually."""
FRONT, SIDE = 0.12, -0.25
"""No palm is closer to the trunk [m], nor further on the right side [m]."""


@dataclass(frozen=True, slots=True)
class HandPoses:
    """Of the palm in the person's frame: x along the fingers, z out of the palm.

    Attributes:
        positions: (k, 3) [m]; rotations: (k, 3, 3).
    """

    positions: Array
    rotations: Array

    def part(self, count: int) -> HandPoses:
        """So many of them, spread over all."""
        chosen = np.linspace(0, len(self.positions) - 1, count).astype(int)
        return HandPoses(self.positions[chosen].copy(), self.rotations[chosen].copy())


def hand_poses(count: int, seed: int) -> HandPoses:
    """Poses that a session might have; the same for the same seed."""
    random = np.random.default_rng([seed, 31])
    positions, rotations = palm(_postures(random, 4 * count + 100))
    kept = np.flatnonzero((positions[:, 0] > FRONT) & (positions[:, 1] > SIDE))[:count]
    return HandPoses(positions[kept].copy(), rotations[kept].copy())


def _postures(random: np.random.Generator, count: int) -> Array:
    """Joints, (k, 7) [rad]."""
    anywhere = random.uniform(LOWER, HIGHER, (count, 7))
    usual = WORK + WIDTH * random.standard_normal((count, 7))
    turned = np.concatenate([usual[:, :4], anywhere[:, 4:]], axis=1)
    kind = random.uniform(size=(count, 1))
    chosen = np.where(kind < 0.5, usual, np.where(kind < 0.75, turned, anywhere))
    joints: Array = np.clip(chosen, LOWER, HIGHER)
    return joints


def palm(joints: Array) -> tuple[Array, Array]:
    """Positions (k, 3) [m] and rotations (k, 3, 3) of the palm for joints (k, 7) [rad]."""
    abduction, flexion, rotation, elbow, pronation, bend, deviation = joints.T
    upper = _about(0, abduction) @ _about(1, -flexion) @ _about(2, rotation)
    fore = upper @ _about(1, -elbow)
    hand = fore @ _about(2, pronation) @ _about(0, bend) @ _about(1, deviation)
    down = np.array([0.0, 0.0, -1.0])
    positions = SHOULDER + UPPER * upper @ down + FORE * fore @ down + HAND * hand @ down
    fingers, out = hand @ down, hand @ np.array([0.0, -1.0, 0.0])
    rotations: Array = np.stack([fingers, np.cross(out, fingers), out], axis=2)
    return positions, rotations


def _about(axis: int, angles: Array) -> Array:
    """Rotations about a coordinate axis, (k, 3, 3)."""
    c, s, i, j = np.cos(angles), np.sin(angles), (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((len(angles), 3, 3))
    R[:, axis, axis], R[:, i, i], R[:, j, j], R[:, i, j], R[:, j, i] = 1.0, c, c, -s, s
    return R
