"""Beyond the papers: the giant's two redundant degrees of freedom by the criterion of ContactAware.

The PPU may stand anywhere below the same pose of the handle. HapticGiant puts joints 2 and 3 at set angles
(prepositioning); here the Stein divergence from a desired horizontal force ellipsoid decides.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..control.serial import SerialChain
from ..machines.giant.config import GiantConfig
from ..machines.giant.kinematics import Branch, UnreachableError, inverse_kinematics
from ..machines.giant.names import JOINTS, PPU_JOINTS
from ..machines.giant.prepositioning import Q2_REFERENCE, Q3_REFERENCE
from ..machines.rhi.manipulability import Shape, force_ellipsoid, stein, velocity_ellipsoid
from ..machines.rhi.saturation import force_limit
from ..models import Array, Robot
from ..runtime.configuration import config
from .outcome import Outcome, Progress, Row

TITLE = "the giant's redundancy by the criterion of the redundant interface"
MU = 5.0
REACH, STEP = 1.1, 0.02
"""How far from the handle the PPU is tried, on a square grid [m]."""
HEIGHT, TILT = -1.05, np.radians(60.0)
DIRECTIONS = 12
QUANTITIES = {
    "exact force limit": "joints 3 and 4 are the limit, and no placement changes their levers",
    "stiff: force ellipsoid": "what knowing the direction of contact is worth",
    "free: velocity ellipsoid": "the same of motion; prepositioning serves all directions at once",
}


class Giant:
    """Handle poses and PPU positions of configs/giant.toml."""

    def __init__(self) -> None:
        loaded = config.load("giant")
        assert isinstance(loaded.config, GiantConfig)
        robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
        arm = robot.without(PPU_JOINTS)
        effort = dict(zip(robot.names, robot.effort.tolist(), strict=True))
        self.limit = np.array([effort[name] for name in JOINTS])
        limits = loaded.config.giant.manipulator
        self._lower, self._upper = np.array(limits.lower), np.array(limits.upper)
        self._chain = SerialChain(arm, ["handle"])
        self._q, self._qd = np.zeros(6), np.zeros(6)
        self._chain.bind(self._q, self._qd)

    def jacobian(self, q: Array) -> Array:
        """Jacobian of the handle's horizontal motion, (2, 6)."""
        self._q[:] = q
        self._chain.update()
        J: Array = self._chain.frames[0].J[:2].copy()
        return J

    def postures(self, T: Array, grid: Array) -> Array:
        """Joints (k, 6) within the limits that reach a handle pose from PPU positions of a grid (g, 2)."""
        joints = []
        for ppu in grid:
            try:
                q = inverse_kinematics(T, ppu, Branch())
            except UnreachableError:
                continue
            if ((self._lower <= q) & (q <= self._upper)).all():
                joints.append(q)
        return np.array(joints)


def handle_pose(yaw: float) -> Array:
    """Handle at the origin, its axis tilted against the yaw, (4, 4)."""
    T = np.eye(4)
    axis = np.array([-np.sin(TILT) * np.cos(yaw), -np.sin(TILT) * np.sin(yaw), -np.cos(TILT)])
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    T[:3, :3] = np.stack([np.cross(across, axis), across, axis], axis=1)
    T[2, 3] = HEIGHT
    return T


def run(progress: Progress) -> Outcome:
    """Compare both placements of the PPU for one handle pose and every horizontal direction."""
    giant = Giant()
    ticks = np.arange(-REACH, REACH + STEP / 2, STEP)
    grid = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    Q = giant.postures(handle_pose(0.0), grid)
    progress(f"{len(Q)} placements of the PPU")
    J = np.array([giant.jacobian(q) for q in Q])
    A = velocity_ellipsoid(J, giant.limit)
    # the reference of HapticGiant keeps the handle where it is and turns joints 2 and 3 to their best angles
    placed = _settled(Q)
    home = giant.jacobian(placed)
    shape = Shape.of_home(force_ellipsoid(home, giant.limit), MU)
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    gains: dict[str, list[float]] = {name: [] for name in QUANTITIES}
    for angle in angles:
        u = np.array([np.cos(angle), np.sin(angle)])
        uu = np.outer(u, u)
        stiff, free = (
            J[int(np.argmin(stein(A, np.asarray(np.linalg.inv(desired), float))))]
            for desired in (shape.stiff(uu), shape.free(uu))
        )
        pull = [float(force_limit(j, giant.limit, u)) for j in (stiff, home)]
        ease = [float(u @ velocity_ellipsoid(j, giant.limit) @ u) ** 0.5 for j in (free, stiff, home)]
        for name, gain in zip(
            QUANTITIES, (pull[0] / pull[1], ease[2] / ease[1], ease[0] / ease[2]), strict=True
        ):
            gains[name].append(gain)
    rows = [
        Row(
            f"{name} along u, criterion over prepositioning: mean / least / largest over the directions",
            "-",
            f"{np.mean(gains[name]):.2f} / {min(gains[name]):.2f} / {max(gains[name]):.2f}",
            note,
        )
        for name, note in QUANTITIES.items()
    ]

    def draw(figure: Any) -> None:
        axes = figure.subplots(subplot_kw={"projection": "polar"})
        full = np.concatenate([angles, angles + np.pi, angles[:1]])
        for (name, values), marker in zip(gains.items(), "os^", strict=True):
            axes.plot(full, [*values, *values, values[0]], marker=marker, ms=4, label=name)
        axes.plot(full, np.ones_like(full), "k:", lw=0.8, label="prepositioning")
        axes.set(xlabel="horizontal direction u [deg]", ylabel="capability along u over prepositioning's [-]")
        axes.yaxis.labelpad = 28
        axes.set_rlabel_position(112.5)
        figure.legend(loc="outside lower center", ncols=2, fontsize=7)

    return Outcome(rows, {"gains": gains, "placements": len(Q)}, draw, (5.0, 5.0))


def _settled(Q: Array) -> Array:
    """The joints (6,) where prepositioning comes to rest: joints 2 and 3 nearest to their references."""
    away = np.hypot(Q[:, 1] - Q2_REFERENCE, Q[:, 2] - Q3_REFERENCE)
    return np.asarray(Q[int(np.argmin(away))])
