"""HapticGiant, Table I: the printed Denavit-Hartenberg rows against the URDF of machine and simulation."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pinocchio as pin

from ..machines.giant.config import GiantConfig
from ..machines.giant.kinematics import T_BASE_DH, Branch, inverse_kinematics
from ..machines.giant.names import PPU_JOINTS
from ..machines.giant.prepositioning import Q2_REFERENCE, Q3_REFERENCE
from ..models import Array, Robot
from ..models.dh import DhRow, forward
from ..runtime.configuration import config
from .outcome import Outcome, Progress, Row

TITLE = "Denavit-Hartenberg table and masses against the URDF (Table I)"
PAPER = (
    ("PPU 1", "prismatic", 0.0, 0.0, 0.0, 90.0),
    ("PPU 2", "prismatic", 90.0, 0.0, 0.0, 90.0),
    ("Manipulator 1", "revolute", 0.0, 0.0, 0.53, 0.0),
    ("Manipulator 2", "revolute", 0.0, 0.0, 0.67, 0.0),
    ("Manipulator 3", "revolute", 180.0, -0.75, 0.0, 90.0),
    ("Manipulator 4", "revolute", -90.0, 0.0, 0.42, 0.0),
    ("Manipulator 5", "revolute", 90.0, 0.0, 0.0, 90.0),
    ("Manipulator 6", "revolute", 0.0, 0.12, 0.0, 0.0),
)
"""As printed: kind of joint, theta [deg], d [m], a [m], alpha [deg]; the joint adds to theta or to d."""
LINKS, MASS, GANTRY = 2.5, 36.8, (4.7, 5.5)
"""Total length of the links [m], moving mass without the slip ring's rotor [kg], size of the gantry [m]."""
POSTURES = 2000


def printed() -> tuple[DhRow, ...]:
    """The rows of the paper."""
    return tuple(
        DhRow(name, kind, theta * pi / 180.0, d, a, alpha * pi / 180.0)  # type: ignore[arg-type]
        for name, kind, theta, d, a, alpha in PAPER
    )


def postures(settings: GiantConfig, count: int) -> Array:
    """Random gantry and joints within their limits, (count, 8)."""
    m, ppu = settings.giant.manipulator, settings.giant.ppu
    lower, upper = (np.clip([*p, *q], -pi, pi) for p, q in ((ppu.lower, m.lower), (ppu.upper, m.upper)))
    drawn: Array = np.random.default_rng(0).uniform(lower, upper, (count, len(lower)))
    return drawn


def run(progress: Progress) -> Outcome:
    """Both in random postures; the closed-form inverse in the same."""
    loaded = config.load("giant")
    assert isinstance(loaded.config, GiantConfig)
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    rows = printed()
    far, back = np.zeros((POSTURES, 2)), np.zeros(POSTURES)
    for k, q in enumerate(postures(loaded.config, POSTURES)):
        T = robot.placement(q, "handle")
        off = np.linalg.inv(T) @ forward(T_BASE_DH, rows, q)[-1]
        far[k] = np.linalg.norm(off[:3, 3]), np.linalg.norm(pin.log3(off[:3, :3]))
        if 0.0 < q[5] + q[6] < pi:
            branch = Branch(bool(q[5] >= 0.0), bool(q[3] >= 0.0))
            again = np.concatenate([q[:2], inverse_kinematics(T, q[:2], branch)])
            back[k] = np.abs(robot.placement(again, "handle") - T).max()
    length = sum(abs(row.a) + abs(row.d) for row in rows)
    arm = robot.without(PPU_JOINTS)
    mass = sum(body.mass for body in arm.model.inertias[1:])
    width = [
        high - low
        for low, high in zip(loaded.config.giant.ppu.lower, loaded.config.giant.ppu.upper, strict=True)
    ]
    distance, angle = far.max(0)
    found = [
        Row(
            "handle, printed rows against the URDF, worst distance [m] / angle [rad]",
            "the same chain",
            f"{distance:.1e} / {angle:.1e}",
            f"{POSTURES} postures; computed, nothing is simulated",
        ),
        Row(
            "closed-form inverse (IV-A), worst entry of the pose that it leads back to",
            "possible in closed form",
            f"{back.max():.1e}",
            "the paper omits the derivation",
        ),
        Row("total length of the links [m]", f"{LINKS:g}", f"{length:.2f}", "the sum of |a| and |d|"),
        Row(
            "moving mass without the slip ring's rotor [kg]",
            f"{MASS:g}",
            f"{mass:.1f}",
            "its distribution over the parts is an estimate",
        ),
        Row(
            "gantry [m]",
            "{:g} x {:g}, outer size".format(*GANTRY),
            "{:.1f} x {:.1f}, travel".format(*width),
            "the travel is not in the paper; ours is chosen",
        ),
    ]
    figures = {
        "distance": float(distance),
        "angle": float(angle),
        "inverse": float(back.max()),
        "length": length,
        "mass": mass,
    }
    return Outcome(found, figures, lambda figure: _draw(figure, robot, rows), (8.0, 4.0))


def _draw(figure: Any, robot: Robot, rows: tuple[DhRow, ...]) -> None:
    q = np.array([0.0, 0.0, 0.0, Q2_REFERENCE, Q3_REFERENCE, 0.96, 0.61, 0.0])
    frames = np.array([T[:3, 3] for T in forward(T_BASE_DH, rows, q)[1:]])
    names = [f"joint_{i}" for i in range(1, 7)]
    joints = np.array([robot.placement(q, name)[:3, 3] for name in [*names, "handle"]])
    for axes, (i, j) in zip(figure.subplots(1, 2), ((0, 1), (0, 2)), strict=True):
        axes.plot(frames[:, i], frames[:, j], "-o", color="tab:blue", ms=4, label="frames of Table I")
        axes.plot(joints[:, i], joints[:, j], "x", color="tab:orange", ms=7, label="joints of the URDF")
        axes.set(xlabel=f"{'xyz'[i]} [m]", ylabel=f"{'xyz'[j]} [m]", aspect="equal")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
