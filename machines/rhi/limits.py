"""What a session of a redundant interface may touch."""

from __future__ import annotations

import numpy as np

from ...runtime.core.machine import LimitSpec
from .config import RhiConfig
from .machine import drive_names


class RhiLimits:
    """Angles and torques of the motors, and their measured or commanded values in a logged state."""

    def __init__(self, config: RhiConfig) -> None:
        motors = config.rhi.motors
        names = [name.replace("_", " ") for name in drive_names(config)]
        angles = zip(names, motors.lower, motors.upper, strict=True)
        torques = zip(names, motors.torque, strict=True)
        self.specs = (
            *(LimitSpec(name, low, high, "rad") for name, low, high in angles),
            *(LimitSpec(f"{name} torque", -most, most, "N m") for name, most in torques),
        )

    def values(self, state: np.void) -> list[float]:
        """Values in the order of ``specs``, from one record of the machine's state."""
        return [*state["q"].tolist(), *state["torque"].tolist()]
