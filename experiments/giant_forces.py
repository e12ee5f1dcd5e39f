"""HapticGiant, III-B: 50 N and 10 N m in any direction, checked over the workspace against the motors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from ..control.serial import SerialChain
from ..machines.giant.config import GiantConfig
from ..machines.giant.names import JOINTS, PPU_JOINTS
from ..machines.giant.prepositioning import Q2_REFERENCE, Q3_REFERENCE
from ..machines.rendering.tool import carrying
from ..models import Array, Robot
from ..runtime.configuration import config
from .outcome import Outcome, Progress, Row

TITLE = "50 N and 10 N m in any direction (III-B), over the workspace"
FORCE, TORQUE = 50.0, 10.0
"""Of the paper, about, in any direction [N], [N m]."""
POSTURES = 4000
NOTE = "computed, at rest, of {} postures, weight of arm and handle taken off; joint {} most often the first"
"""Of how many, and whose torque is the limit."""


@dataclass(frozen=True, slots=True)
class Strength:
    """What the motors render at the handle at rest in k postures.

    Attributes:
        force, torque: largest one that is rendered in every direction, (k,) [N], [N m]; the other is none.
        both: share of a motor's torque that is needed for FORCE and TORQUE in their worst directions, (k,).
        motor: which one that is, (k,).
        direction: of the force that it renders worst, (k, 3).
    """

    force: Array
    torque: Array
    both: Array
    motor: Array
    direction: Array


def strength(J: Array, gravity: Array, limit: Array) -> Strength:
    """Statics: motor i needs |g_i| + F |J_v,i| + M |J_w,i|, where force and torque point along its columns.

    Args:
        J: Jacobians of the handle, (k, 6, n).
        gravity: torques that hold the arm, (k, n) [N m].
        limit: torques of the motors, (n,) [N m].
    """
    linear, angular = np.linalg.norm(J[:, :3], axis=1), np.linalg.norm(J[:, 3:], axis=1)
    left = limit - np.abs(gravity)
    with np.errstate(divide="ignore"):
        force, torque = (left / linear).min(1), (left / angular).min(1)
    need = (np.abs(gravity) + FORCE * linear + TORQUE * angular) / limit
    weakest = (left / np.maximum(linear, 1e-9)).argmin(1)
    column = np.take_along_axis(J[:, :3], weakest[:, None, None], axis=2)[:, :, 0]
    direction = column / np.linalg.norm(column, axis=1, keepdims=True)
    return Strength(force, torque, need.max(1), need.argmax(1), direction)


def postures(settings: GiantConfig, count: int, preposed: bool) -> Array:
    """Random joints within their limits and the tilt's, (count, 6); or where prepositioning leads them."""
    m, random = settings.giant.manipulator, np.random.default_rng(0)
    kept: list[Array] = []
    lower, upper = np.clip(m.lower, -np.pi, np.pi), np.clip(m.upper, -np.pi, np.pi)
    while len(kept) < count:
        q = random.uniform(lower, upper)
        if m.tilt[0] <= q[3] + q[4] <= m.tilt[1]:
            kept.append(q)
    Q = np.array(kept)
    if preposed:
        Q[:, 1:3] = Q2_REFERENCE, Q3_REFERENCE
    return Q


class Statics:
    """Jacobian and weight of the giant with its handle."""

    def __init__(self) -> None:
        loaded = config.load("giant")
        assert isinstance(loaded.config, GiantConfig)
        self.settings = loaded.config
        robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
        device = self.settings.devices["force_torque"]
        robot = carrying(robot, "handle", "force_torque", device, self.settings.giant.handle)
        effort = dict(zip(robot.names, robot.effort.tolist(), strict=True))
        self.limit = np.array([effort[name] for name in JOINTS])
        self._arm = robot.without(PPU_JOINTS)
        self._chain = SerialChain(self._arm, ["handle"])
        self._q, self._qd = np.zeros(len(JOINTS)), np.zeros(len(JOINTS))
        self._chain.bind(self._q, self._qd)

    def of(self, Q: Array) -> Strength:
        """In postures, (k, 6) [rad]."""
        J, gravity = [], []
        model, data = self._arm.model, self._arm.data
        for q in Q:
            self._q[:] = q
            self._chain.update()
            J.append(self._chain.frames[0].J.copy())
            gravity.append(pin.computeGeneralizedGravity(model, data, self._arm.configuration(q)))
        return strength(np.array(J), np.array(gravity), self.limit)


def run(progress: Progress) -> Outcome:
    """Anywhere within the limits, and where prepositioning leads joints 2 and 3."""
    giant = Statics()
    found, rows, figures = {}, [], {}
    for name, preposed in (("anywhere", False), ("where the gantry follows", True)):
        progress(name)
        s = found[name] = giant.of(postures(giant.settings, POSTURES, preposed))
        share, worst = float((s.both <= 1.0).mean()), int(s.force.argmin())
        rows += [
            Row(
                f"{name}: postures with {FORCE:g} N and {TORQUE:g} N m together, each in any direction [%]",
                "about, in any direction",
                f"{100 * share:.1f}",
                NOTE.format(POSTURES, np.bincount(s.motor).argmax() + 1),
            ),
            Row(
                f"{name}: force in every direction, least / 5th percentile / median [N]",
                f"{FORCE:g}",
                _spread(s.force),
                "worst along ({:.2f}, {:.2f}, {:.2f})".format(*s.direction[worst]),
            ),
            Row(
                f"{name}: torque in every direction, least / 5th percentile / median [N m]",
                f"{TORQUE:g}",
                _spread(s.torque),
                "",
            ),
        ]
        figures[name] = {"share": share, "force": float(s.force.min()), "torque": float(s.torque.min())}

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 2)
        for ax, key, unit, most in zip(axes, ("force", "torque"), ("N", "N m"), (FORCE, TORQUE), strict=True):
            for (name, s), line in zip(found.items(), ("-", "--"), strict=True):
                x = np.sort(getattr(s, key))
                ax.plot(x, 100 * np.arange(1, len(x) + 1) / len(x), ls=line, label=name)
            ax.axvline(most, color="black", ls=":", lw=0.8)
            ax.set(xlabel=f"{key} in every direction [{unit}]", ylabel="postures with no more [%]")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)

    return Outcome(rows, figures, draw, (8.0, 4.0))


def _spread(values: Array) -> str:
    return " / ".join(f"{x:.1f}" for x in (values.min(), *np.percentile(values, [5.0, 50.0])))
