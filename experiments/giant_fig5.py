"""HapticGiant, Fig. 5(b): poses of a standing person's hand that the giant's handle reaches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..machines.giant.config import GiantConfig
from ..machines.giant.kinematics import DROP, FOREARM, HANDLE
from ..models import Array
from ..runtime.configuration import config
from .outcome import Outcome, Progress, Row
from .seated_operator import HandPoses, hand_poses

TITLE = "poses of a standing person's hand that the handle reaches (Fig. 5b)"
FLOOR = -2.05
"""Of the room in B [m]; the giant's URDF puts it there."""
HEIGHTS, SHOULDERS = (1.60, 1.75, 1.90), 0.82
"""Of persons [m], and of their shoulders as a share of it."""
COUNT, GRIPS, SUBSET = 3000, 400, 600
"""Poses; how the handle may sit in the hand; poses of the search for that."""
CAUSES = ("height", "joint 4", "tilt", "joint 5", "joint 6")


@dataclass(frozen=True, slots=True)
class Reach:
    """What keeps k poses from the handle.

    Attributes:
        beyond: whether each of ``CAUSES`` does, (5, k).
        reached: that none does, (k,).
    """

    beyond: NDArray[np.bool_]
    reached: NDArray[np.bool_]


def reach(settings: GiantConfig, positions: Array, rotations: Array) -> Reach:
    """Poses of the handle in B in the middle of the room, where the gantry puts joints 1 to 3 at their best.

    What is left are height, tilt and roll (the closed form of IV-A).

    Args:
        settings: of the giant.
        positions: (k, 3) [m].
        rotations: (k, 3, 3).
    """
    m = settings.giant.manipulator
    axis = rotations[:, :, 2]
    tilt = np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), -axis[:, 2])
    q6 = np.arctan2(-rotations[:, 2, 1], rotations[:, 2, 0])
    cos_q4 = (-positions[:, 2] - DROP - HANDLE * np.cos(tilt)) / FOREARM
    q4 = np.arccos(np.clip(cos_q4, -1.0, 1.0))
    beyond = np.array(
        [
            np.abs(cos_q4) > 1.0,
            (q4 < m.lower[3]) | (q4 > m.upper[3]),
            (tilt < m.tilt[0]) | (tilt > m.tilt[1]),
            (tilt - q4 < m.lower[4]) | (tilt - q4 > m.upper[4]),
            (q6 < m.lower[5]) | (q6 > m.upper[5]),
        ]
    )
    return Reach(beyond, np.logical_not(np.logical_or.reduce(beyond, axis=0)))


def standing(poses: HandPoses, height: float) -> Array:
    """Positions of the hand in B for a person of a height in the middle of the room, (k, 3) [m]."""
    at: Array = poses.positions + np.array([0.0, 0.0, FLOOR + SHOULDERS * height])
    return at


def best_grip(settings: GiantConfig, poses: HandPoses, random: np.random.Generator) -> Array:
    """How the handle sits in the hand, (3, 3): of many ways the one with which most poses are reached."""
    grips = [pin.Quaternion(*_unit(random.standard_normal(4))).matrix() for _ in range(GRIPS)]
    at = standing(poses, HEIGHTS[1])
    shares = [reach(settings, at, poses.rotations @ grip).reached.mean() for grip in grips]
    best: Array = grips[int(np.argmax(shares))]
    return best


def run(progress: Progress) -> Outcome:
    """Persons of three heights; the grip is searched with other poses than those that are counted."""
    loaded = config.load("giant")
    settings = loaded.config
    assert isinstance(settings, GiantConfig)
    progress("how the handle sits in the hand")
    grip = best_grip(settings, hand_poses(SUBSET, 1), np.random.default_rng(0))
    poses = hand_poses(COUNT, 2)
    found = {h: reach(settings, standing(poses, h), poses.rotations @ grip) for h in HEIGHTS}
    rows = [
        Row(
            f"poses of the hand that are reached, person of {h:.2f} m [%]",
            "a selection, in pictures",
            f"{100 * r.reached.mean():.1f}",
            f"computed; {_causes(r)}",
        )
        for h, r in found.items()
    ]
    note = (
        "a synthetic arm with joint limits; person and gantry are in the middle of the room; of so many ways"
        " in which the handle may sit in the hand the best, for the paper does not print its own"
    )
    rows.append(Row("poses, grip", "-", f"{COUNT}, {GRIPS}", note))
    figures = {f"{h:.2f}": float(r.reached.mean()) for h, r in found.items()}

    def draw(figure: Any) -> None:
        axes, r = figure.subplots(), found[HEIGHTS[1]]
        at = standing(poses, HEIGHTS[1]) - [0.0, 0.0, FLOOR]
        for mask, mark, colour, name in (
            (~r.reached, "x", "tab:orange", "missed"),
            (r.reached, "o", "tab:blue", "reached"),
        ):
            axes.plot(at[mask, 0][::3], at[mask, 2][::3], mark, ls="", ms=2, color=colour, label=name)
        axes.set(xlabel="in front of the person [m]", ylabel="height above the floor [m]", aspect="equal")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)

    return Outcome(rows, figures, draw, (5.0, 5.5))


def _causes(reach: Reach) -> str:
    """How many poses each limit keeps away; several may."""
    shares = zip(CAUSES, 100 * reach.beyond.mean(1), strict=True)
    return "beyond " + ", ".join(f"{name}: {share:.0f} %" for name, share in shares)


def _unit(x: Array) -> Array:
    unit: Array = x / np.linalg.norm(x)
    return unit
