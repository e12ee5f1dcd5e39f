"""What a session of an arm may touch."""

from __future__ import annotations

from math import isinf

import numpy as np

from ...runtime.core.machine import LimitSpec
from ..rendering.twin import twin_limits
from .config import ArmConfig, RevoluteJoint, RevoluteSum
from .machine import joint_sums


class ArmLimits:
    """What a session of an arm may touch, and the measured values of a logged state."""

    def __init__(self, config: ArmConfig) -> None:
        arm = config.arm
        self._weights = [np.array(total.weight) for total in joint_sums(config)]
        rows = [
            (name.replace("_", " "), joint.range, isinstance(joint, RevoluteJoint))
            for name, joint in arm.joints.items()
        ]
        rows += [(total.name, total.range, isinstance(total, RevoluteSum)) for total in arm.sums or ()]
        sides = [
            (f"{box.frame.replace('_', ' ')} {axis}", low, high)
            for box in arm.boxes or ()
            for axis, low, high in zip("xyz", box.lower, box.upper, strict=True)
        ]
        # a box that is open on both sides has no limit there
        self._sides = [i for i, (_, low, high) in enumerate(sides) if not (isinf(low) and isinf(high))]
        self.specs = (
            *(LimitSpec(name, ends[0], ends[1], "rad" if turns else "m") for name, ends, turns in rows),
            *(LimitSpec(*sides[i], "m") for i in self._sides),
            *(twin := twin_limits(config.twins)),
        )
        self._chain = bool(twin)

    def values(self, state: np.void) -> list[float]:
        """Measured values, and the twin's, in the order of ``specs``, from a record of its state."""
        q = state["link"]
        sums = [float(weight @ q) for weight in self._weights]
        twin = state["twin"].item() if self._chain else ()
        return [*q.tolist(), *sums, *state["points"].reshape(-1)[self._sides].tolist(), *twin]
