"""What the hands of simulated arms may take and touch, in MuJoCo: the extra ``scene``.

The arms are not in it. Each hand is a free body that its arm holds by a stiff spring and damper (a `Hold`):
what the scene does to a hand is what the arm's sensor feels, and the hand feels the opposite.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from math import hypot
from typing import Any

import numpy as np

from ..models import Array
from .hold import Hold

STIFFNESS, DAMPING = (1.5e4, 100.0), (70.0, 0.5)
"""Of the flange between an arm and its hand, translation and rotation [N/m, N m/rad], [N s/m, N m s/rad]."""
STRONG = 1e6
"""A flange does not come off [N], [N m]."""
OPEN, SHUT = 0.09, 0.0
"""Between the jaws, as the drive of a gripper is told [m]."""


class SceneError(Exception):
    """There is no such scene, or nothing to simulate it with."""


class Scene:
    """Hands, and what is around them.

    Attributes:
        closed: whether a hand is to close, one a hand; write here.
        peak: largest force between a hand and its arm so far [N].
    """

    def __init__(self, text: str, hands: Sequence[str]) -> None:
        """Build it at rest.

        Args:
            text: an MJCF model with a free body, a tendon "NAME_jaws" and a drive "NAME_grip" for each hand.
            hands: their names.

        Raises:
            SceneError: MuJoCo is not installed, or takes the text for no such model.
        """
        try:
            mujoco: Any = import_module("mujoco")
        except ImportError as error:
            raise SceneError("a scene needs the package mujoco, the extra scene") from error
        self._mujoco = mujoco
        try:
            self._model = mujoco.MjModel.from_xml_string(text)
            self._data = data = mujoco.MjData(self._model)
            self._bodies = [data.body(name) for name in hands]
            self._jaws = [data.tendon(f"{name}_jaws") for name in hands]
            self._grips = [data.actuator(f"{name}_grip") for name in hands]
        except (ValueError, KeyError) as error:
            raise SceneError(f"MuJoCo says of the scene: {error}") from error
        self._places = [self._model.body(name).jntadr[0] for name in hands]
        self.closed, self.peak = [False for _ in hands], 0.0
        for grip in self._grips:
            grip.ctrl[0] = OPEN
        mujoco.mj_forward(self._model, data)

    def put(self, i: int, position: Array, rotation: Array) -> None:
        """A hand is at rest at a pose of its palm, (3,) [m] and (3, 3)."""
        data, model = self._data, self._model
        joint = self._places[i]
        at, rate = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        data.qpos[at : at + 3] = position
        self._mujoco.mju_mat2Quat(data.qpos[at + 3 : at + 7], np.ascontiguousarray(rotation).reshape(-1))
        data.qvel[rate : rate + 6] = 0.0
        self._mujoco.mj_forward(model, data)

    def hold(self, i: int, hold: Hold, position: Array, rotation: Array) -> None:
        """Tell the hold of an arm's palm, at a pose (3,) and (3, 3), where its hand is and how it moves."""
        body, data = self._bodies[i], self._data
        hold.stiffness[:], hold.damping[:], hold.strength[:] = STIFFNESS, DAMPING, STRONG
        hold.error[:3] = body.xpos - position
        hold.error[3:] = _turn(body.xmat.reshape(3, 3), rotation)
        at = self._model.jnt_dofadr[self._places[i]]
        hold.rate[:3] = data.qvel[at : at + 3]
        hold.rate[3:] = body.xmat.reshape(3, 3) @ data.qvel[at + 3 : at + 6]

    def step(self, wrenches: Sequence[Array]) -> None:
        """Advance by the period of the model under what the hands did to their arms, (6,) each [N, N m]."""
        for body, grip, closed, wrench in zip(self._bodies, self._grips, self.closed, wrenches, strict=True):
            np.negative(wrench, out=body.xfrc_applied)
            self.peak = max(self.peak, hypot(*wrench[:3].tolist()))
            grip.ctrl[0] = SHUT if closed else OPEN
        self._mujoco.mj_step(self._model, self._data)

    @property
    def opening(self) -> list[float]:
        """Between the jaws of each hand [m]."""
        return [float(jaws.length[0]) for jaws in self._jaws]

    def position(self, name: str) -> Array:
        """Where the origin of a body is, (3,) [m]."""
        return np.array(self._data.body(name).xpos)

    def rotation(self, name: str) -> Array:
        """Of a body, (3, 3)."""
        return np.array(self._data.body(name).xmat).reshape(3, 3)

    def touch(self, name: str, other: str) -> Array:
        """Force of all contacts of one body on another one, (3,) in the world's axes [N]."""
        model, data = self._model, self._data
        own, its = (model.body(each).rootid[0] for each in (name, other))
        force, total = np.zeros(6), np.zeros(3)
        for k in range(data.ncon):
            contact = data.contact[k]
            roots = [model.body_rootid[model.geom_bodyid[g]] for g in contact.geom]
            if sorted(roots) != sorted((own, its)) or own == its:
                continue
            self._mujoco.mj_contactForce(model, data, k, force)
            there = contact.frame.reshape(3, 3).T @ force[:3]  # on the second geom
            total += there if roots[1] == its else -there
        return total

    def energy(self) -> float:
        """Kinetic energy, and potential in the field of gravity, of all that is in it [J]."""
        model, data = self._model, self._data
        self._mujoco.mj_energyPos(model, data)
        self._mujoco.mj_energyVel(model, data)
        return float(data.energy.sum())


def _turn(there: Array, here: Array) -> Array:
    """Rotation vector from one attitude to another, (3,); they differ little."""
    R = there @ here.T
    return 0.5 * np.array((R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]))
