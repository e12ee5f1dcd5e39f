"""Links that give way to what pushes them beside the hand at the handle, and what pushes simulated ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ...control.compliance import Compliance
from ...control.limits import Limits
from ...control.notice import Notice
from ...models import Array, ModelError, Robot
from .check import Found
from .sections import Compliance as Section
from .sections import ForceControl, Push

QUIET_S = 0.5
"""Pushes that follow each other faster are one to people [s]."""
EDGE_S = 50e-3
"""Within that time, or a quarter of its own, a simulated push rises and falls [s]."""


def compliance_of(
    section: Section | None, torque: Sequence[float], limits: Limits, yielding: Array
) -> Compliance | None:
    """What a configuration says; rated torques (m,) [N m or N] and how far held joints yield to them."""
    if section is None:
        return None
    return Compliance(
        *(section.threshold * np.array(torque, float), yielding, limits.velocity, limits.acceleration),
        section.relax,
    )


def check_compliance(section: Section | None, control: ForceControl) -> Found:
    """Pushes give way within what the motors can, which only Gauss's principle asks for."""
    if section is None or control.detection == "gauss":
        return []
    fix = 'write detection = "gauss", or remove [compliance]'
    return [("compliance", f'does not go with detection = "{control.detection}"', fix)]


class Announcer:
    """Says once which joint gives way."""

    def __init__(
        self, names: Sequence[str], compliance: Compliance | None, notes: list[str], dt: float
    ) -> None:
        """For the joints of these names, (m,)."""
        self._names, self._compliance, self._notes = names, compliance, notes
        self._notices = [Notice(1e-9, 1e-9, round(QUIET_S / dt)) for _ in names] if compliance else []

    def update(self) -> None:
        """A word for each joint that has just begun."""
        if not self._compliance:
            return
        excess, external = self._compliance.excess.tolist(), self._compliance.external.tolist()
        for name, notice, beyond, size in zip(self._names, self._notices, excess, external, strict=True):
            if notice.update(abs(beyond)):
                self._notes.append(
                    f"{name} gives way: {abs(size):.0f} N m that no hand at the handle explains"
                )


class Pushes:
    """Forces on frames of a simulated arm, each for a time."""

    def __init__(self, robot: Robot, pushes: Sequence[Push]) -> None:
        """The arm alone, whose base only translates."""
        self._robot, self._data = robot, robot.model.createData()
        self._pushes = [(push, robot.frame(push.frame), np.array(push.force)) for push in pushes]

    def apply(self, t: float, q: Array, torque: Array) -> None:
        """Write the torques of the joints (m,) at a time [s] and place (m,)."""
        if not self._pushes:
            return
        torque[:] = 0.0
        for push, frame, force in self._pushes:
            if share := _share(t - push.at, push.seconds):
                model, at = self._robot.model, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
                J = pin.computeFrameJacobian(model, self._data, self._robot.configuration(q), frame, at)
                torque += share * (J[:3].T @ force)


def _share(t: float, seconds: float) -> float:
    """Of a push, 0 to 1, so long after it began [s]."""
    edge = min(EDGE_S, 0.25 * seconds)
    return float(np.clip(min(t, seconds - t) / edge, 0.0, 1.0))


def check_pushes(robot: Robot, pushes: Sequence[Push]) -> Found:
    """Frames that the model lacks."""
    found: Found = []
    for i, push in enumerate(pushes):
        try:
            robot.frame(push.frame)
        except ModelError:
            found.append(
                (f"simulation.pushes[{i}].frame", f"there is no '{push.frame}'", "name a link or joint")
            )
    return found
