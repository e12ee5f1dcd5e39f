"""Inverse kinematics of the Panda in closed form, with q7 free; the method is that of He and Liu.

Any arm with the Panda's axes will do, such as the FR3, whatever its lengths and limits, and any palm on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..binding import pointer
from ..models import Array, ModelError, Robot, serial
from ._kernels import ffi, lib

EVEN = 1e-9
"""By how much an axis may lean, or an offset differ from 0, for the arm to count as a Panda [rad, m]."""
QUARTERS = (-1, 1, 1, -1, 1, 1)
"""Quarter turns about x from each joint to the next."""


class PandaIk:
    """Joint positions for a pose of the palm.

    Attributes:
        solution: the last that was found, (7,) [rad]; own buffer.
    """

    def __init__(self, robot: Robot, palm: str, base: Array | None = None, beyond: float = 0.0) -> None:
        """Take lengths and limits from a model.

        Args:
            robot: with the axes of a Panda.
            palm: name of the frame whose pose is asked for.
            base: pose of the robot's base in the frame in which poses are given, (4, 4); None where they are
                one.
            beyond: how far past their limits joints still count as a solution [rad].

        Raises:
            ModelError: the axes are not a Panda's, or the frame is unknown or not carried by joint 7.
        """
        self.solution = np.zeros(7)
        joints, tip = serial.joints(robot, 7), serial.frame(robot, palm)
        _check(robot, joints, tip)
        offsets = [joint["t"] for joint in joints]
        first = np.eye(4)
        first[:3, :3], first[:3, 3] = np.reshape(joints[0]["R"], (3, 3)), offsets[0]
        self._first = first
        self._arm = ffi.new(
            "panda_arm *",
            {
                "d3": -offsets[2][1],
                "a4": offsets[3][0],
                "a5": -offsets[4][0],
                "d5": offsets[4][1],
                "a7": offsets[6][0],
                "R_palm": tip["R"],
                "t_palm": tip["t"],
                "lower": (robot.lower - beyond).tolist(),
                "upper": (robot.upper + beyond).tolist(),
            },
        )
        self.mount(np.eye(4) if base is None else base)
        self._out = pointer(self.solution, "double", 7)

    def mount(self, base: Array) -> None:
        """Put the robot's base at a pose (4, 4)."""
        first = base @ self._first
        self._arm.R_base, self._arm.t_base = first[:3, :3].reshape(-1).tolist(), first[:3, 3].tolist()

    @property
    def core(self) -> object:
        """The arm for other parts of the C core."""
        return self._arm

    def nearest(self, position: Array, rotation: Array, q7: float, near: Array) -> bool:
        """Write the solution next to a configuration.

        Args:
            position: of the palm, (3,) [m].
            rotation: of the palm, (3, 3).
            q7: of joint 7 [rad].
            near: (7,) [rad].

        Returns:
            False where the pose is out of reach with this q7; then ``solution`` stays as it was.
        """
        pose = pointer(position, "const double", 3), pointer(rotation, "const double", 3, 3)
        return bool(lib.panda_nearest(self._arm, *pose, q7, pointer(near, "const double", 7), self._out))

    def branches(self, position: Array, rotation: Array, q7: float, q1: float = 0.0) -> Array:
        """All solutions inside the limits, (k, 7), at most 8; q1 where joints 1 and 3 are one."""
        found = np.zeros((lib.PANDA_BRANCHES, 7))
        pose = pointer(position, "const double", 3), pointer(rotation, "const double", 3, 3)
        count = lib.panda_branches(self._arm, *pose, q7, q1, pointer(found, "double", lib.PANDA_BRANCHES, 7))
        return found[:count]

    def reach(self, positions: Array, rotations: Array, steps: int) -> NDArray[np.bool_]:
        """Which of many poses (k, 3), (k, 3, 3) have a solution at any of so many q7, (k,)."""
        count = len(positions)
        reached = np.zeros(count, np.uint8)
        lib.panda_reach(
            self._arm,
            count,
            pointer(positions, "const double", count, 3),
            pointer(rotations, "const double", count, 3, 3),
            steps,
            pointer(reached, "unsigned char", count),
        )
        return reached.astype(np.bool_)


def _check(robot: Robot, joints: Sequence[dict[str, Any]], tip: dict[str, Any]) -> None:
    name = robot.model.name
    if len(joints) != 7 or tip["joint"] != 6:
        raise ModelError(name, 0, f"{len(joints)} joints", "a Panda has 7, and the last carries the palm")
    zeros = {1: (0, 1, 2), 2: (0, 2), 3: (1, 2), 4: (2,), 5: (0, 1, 2), 6: (1, 2)}
    for i, joint in enumerate(joints):
        turn = np.eye(3) if i == 0 else _about_x(QUARTERS[i - 1])
        even = i == 0 or np.allclose(np.reshape(joint["R"], (3, 3)), turn, atol=EVEN)
        offset = np.asarray(joint["t"], float)[list(zeros.get(i, ()))]
        along = np.allclose(np.asarray(joint["axis"], float), (0.0, 0.0, 1.0), atol=EVEN)
        if joint["prismatic"] or not (even and along and np.all(np.abs(offset) < EVEN)):
            raise ModelError(
                name, 0, f"joint {i + 1} is not where a Panda has it", "use an arm with its axes"
            )


def _about_x(quarters: int) -> Array:
    return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -quarters], [0.0, quarters, 0.0]])
