"""ContactAware, figs 3 and 4: the 3-DoF example at rest, free and stiff, pushed along x."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..machines.rhi import planar
from ..machines.rhi.manipulability import Shape, force_ellipsoid
from ..machines.rhi.redundant import RedundantArm
from ..machines.rhi.saturation import force_limit, force_share
from ..machines.rhi.self_motion import Ellipsoid, descend
from ..models import Array, Robot
from .outcome import Outcome, Progress, Row

TITLE = "3-DoF example, torques and force in three postures (figs 3 and 4)"
START = np.array([np.pi / 3, -np.pi / 3, -3 * np.pi / 4])
"""q1 cannot be read from the text; pi/3 gives the printed eigenvalues like any other."""
LIMIT, MU = np.full(3, 0.5), 5.0
ALONG = np.array([1.0, 0.0])
PEAK = 3.5
NAMES = ("initial", "free", "stiff")


def run(progress: Progress) -> Outcome:
    """Optimise both postures and render the force of the figure."""
    robot = Robot.from_urdf(planar.urdf("example", planar.THREE_DOF), "example.urdf")
    arm = RedundantArm(robot, planar.HANDLE, ("x", "y"), np.eye(3), np.zeros(3))
    start = arm.at(START)
    x, M0 = start.position.copy(), force_ellipsoid(start.J, LIMIT)
    shape, uu = Shape.of_home(M0, MU), np.outer(ALONG, ALONG)
    postures = [START]
    for name, desired in (("free", shape.free(uu)), ("stiff", shape.stiff(uu))):
        progress(name)
        postures.append(descend(arm, START[None], x, Ellipsoid(desired, LIMIT))[0][0])
    Q = np.array(postures)
    J = arm.reach(Q)[1]
    forces = force_limit(J, LIMIT, ALONG)
    eigenvalues = np.linalg.eigvalsh(M0)
    rows = [
        Row("eigenvalues of M at the start", "2.6, 5.8", f"{eigenvalues[0]:.2f}, {eigenvalues[1]:.2f}"),
        *(
            Row(f"force along x before a motor saturates, {name} [N]", paper, f"{force:.2f}", note)
            for name, paper, force, note in zip(
                NAMES,
                ("< 3.5", "less than at the start", ">= 3.5"),
                forces,
                ("", "", "only this posture renders 3.5 N"),
                strict=True,
            )
        ),
    ]
    figures = {
        "eigenvalues": eigenvalues.tolist(),
        "force_n": dict(zip(NAMES, forces.tolist(), strict=True)),
    }
    return Outcome(rows, figures, lambda figure: _draw(figure, Q, J), (9.0, 7.0))


def _draw(figure: Any, Q: Array, J: Array) -> None:
    t = np.linspace(0.0, 4.0, 400)
    wanted = PEAK * np.sin(np.pi * t / 2)
    axes = figure.subplots(3, 3, sharex="row", sharey="row")
    for k, name in enumerate(NAMES):
        torque = wanted[:, None] * (J[k].T @ ALONG)
        alpha = force_share(torque, LIMIT)
        axes[0, k].plot(t, alpha[:, None] * torque, label=["joint 1", "joint 2", "joint 3"])
        axes[1, k].plot(t, alpha * wanted, label="rendered")
        axes[1, k].plot(t, wanted, lw=0.8, label="wanted")
        axes[0, k].set(title=name, xlabel="t [s]", ylim=(-0.55, 0.55))
        axes[1, k].set(xlabel="t [s]", ylim=(-3.8, 3.8))
        angles = np.cumsum(Q[k])
        nodes = np.vstack([[0.0, 0.0], np.cumsum(0.25 * np.stack([np.cos(angles), np.sin(angles)], 1), 0)])
        axes[2, k].plot(*nodes.T, "o-", color="0.3", label="arm")
        values, vectors = np.linalg.eigh(force_ellipsoid(J[k], LIMIT))
        circle = np.stack([np.cos(np.linspace(0, 2 * np.pi, 100)), np.sin(np.linspace(0, 2 * np.pi, 100))])
        outline = nodes[-1][:, None] + 0.03 * vectors @ (np.sqrt(values)[:, None] * circle)
        axes[2, k].plot(*outline, color="tab:red", label="force ellipsoid")
        axes[2, k].set(aspect="equal", xlabel="x [m]", xlim=(-0.05, 0.5), ylim=(-0.06, 0.38))
    for row, label in enumerate(("torque [N m]", "force along x [N]", "y [m]")):
        axes[row, 0].set_ylabel(label)
        axes[row, 0].legend(fontsize=7)
