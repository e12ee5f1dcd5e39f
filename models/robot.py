"""A serial robot loaded from URDF with pinocchio, linted first."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import cos, sin

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from .dh import Array
from .errors import ModelError
from .linter import lint
from .shapes import Shape, shapes


class Robot:
    """Kinematics and dynamics of a serial robot; joint positions are plain angles or lengths.

    pinocchio stores a continuous joint as (cos, sin); this class takes every joint as one number, in the
    order of the chain, so that q and v have the same length nv.

    Attributes:
        model: pinocchio's model; data: its workspace.
        names: of the moving joints, (nv).
        lower, upper: position limits, infinite for continuous joints, (nv,) [rad or m].
        velocity, effort: limits, (nv,) [rad/s or m/s], [N m or N].
        damping: viscous friction, (nv,) [N m s/rad or N s/m].
        sliding: whether a joint slides; otherwise it turns, (nv).
        shapes: for collisions, of a robot that was loaded from a URDF.
    """

    def __init__(self, model: pin.Model) -> None:
        self.shapes: list[Shape] = []
        self.model = model
        self.data = model.createData()
        self.nv: int = model.nv
        self.names = list(model.names)[1:]
        joints = list(model.joints)[1:]
        self.sliding = [joint.shortname().startswith("JointModelP") for joint in joints]
        index = np.array([int(joint.idx_q) for joint in joints], np.int64)
        bounded = np.array([joint.nq == 1 for joint in joints], np.bool_)
        self._q = pin.neutral(model)
        self._turning = [(int(index[i]), int(i)) for i in np.flatnonzero(~bounded)]
        self._blocks = _runs(index, bounded)
        self.lower: Array = np.where(bounded, model.lowerPositionLimit[index], -np.inf)
        self.upper: Array = np.where(bounded, model.upperPositionLimit[index], np.inf)
        self.velocity: Array = np.array(model.velocityLimit)
        self.effort: Array = np.array(model.effortLimit)
        self.damping: Array = np.array(model.damping)

    @classmethod
    def from_urdf(cls, text: str, source: str) -> Robot:
        """Lint and load a URDF.

        Raises:
            ModelError: for anything a machine would not survive (see ``linter``).
        """
        model, found = _loaded(text, source)
        robot = cls(model.copy())
        robot.shapes = list(found)
        return robot

    def without(self, joints: Sequence[str]) -> Robot:
        """The same robot with these joints held at zero."""
        ids = [self.model.getJointId(name) for name in joints]
        return Robot(pin.buildReducedModel(self.model, ids, pin.neutral(self.model)))

    def configuration(self, q: Array) -> Array:
        """Pinocchio's configuration vector of joint positions q (nv,); own buffer."""
        buffer: Array = self._q
        for target, source in self._blocks:
            buffer[target] = q[source]
        for at, i in self._turning:
            angle = float(q[i])
            buffer[at], buffer[at + 1] = cos(angle), sin(angle)
        return buffer

    def frame(self, name: str) -> int:
        """Pinocchio's id of a frame.

        Raises:
            ModelError: where no link or joint has that name.
        """
        if not self.model.existFrame(name):
            raise ModelError(
                self.model.name, 0, f"no frame '{name}'", f"one of {[f.name for f in self.model.frames]}"
            )
        return int(self.model.getFrameId(name))

    def placement(self, q: Array, frame: str) -> Array:
        """Pose of a frame in the base frame, (4, 4) [m]; convenience, not for the tick."""
        pin.framesForwardKinematics(self.model, self.data, self.configuration(q))
        T: Array = self.data.oMf[self.frame(frame)].homogeneous
        return T


@lru_cache(maxsize=8)  # a session loads the URDFs of its machine and of its twin several times
def _loaded(text: str, source: str) -> tuple[pin.Model, tuple[Shape, ...]]:
    """What a URDF says, as long as nobody changes it."""
    understood = lint(text, source)
    try:
        model = pin.buildModelFromXML(understood)
    except (RuntimeError, ValueError) as error:
        raise ModelError(source, 0, f"pinocchio cannot load it: {error}", "mend the URDF") from error
    return model, tuple(shapes(model, text, source))


def _runs(index: NDArray[np.int64], bounded: NDArray[np.bool_]) -> list[tuple[slice, slice]]:
    """Consecutive joints of one coordinate each: where they are in pinocchio's vector, and in q."""
    runs: list[tuple[slice, slice]] = []
    for i in np.flatnonzero(bounded).tolist():
        at = int(index[i])
        if runs and runs[-1][1].stop == i:
            target, source = runs.pop()
            runs.append((slice(target.start, at + 1), slice(source.start, i + 1)))
        else:
            runs.append((slice(at, at + 1), slice(i, i + 1)))
    return runs
