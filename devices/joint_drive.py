"""A drive of a joint that turns."""

from __future__ import annotations

from ..configs.quantities import AnyAngle
from .torque_drive import TorqueDrive


class JointDrive(TorqueDrive, frozen=True, kw_only=True, tag="joint_drive"):
    """A joint that turns, series-elastic or rigid; its link encoder is on the other side of the spring."""

    zero: AnyAngle = AnyAngle(0.0)
    link_zero: AnyAngle = AnyAngle(0.0)
