"""What the motors of an arm can give at a tick: the hierarchy asks for no more."""

from __future__ import annotations

import numpy as np


class Ability:
    """Torques that accelerations take, and torques that the drives are admitted.

    A motor's torque is ``inertia @ qdd + load + feedback``, of which the drives are admitted ``least`` to
    ``most``: with the feedback, and without it, which is gone in a moment.

    Attributes:
        inertia: of links and rotors, (m, m) [kg m^2 or kg].
        load: at qdd = 0, without what the tracking feeds back, (m,) [N m or N].
        feedback: that, (m,).
        strain: what of it no yielding of the springs explains, (m,).
        least, most: (m,).
    """

    def __init__(self, m: int) -> None:
        self.inertia = np.zeros((m, m))
        self.load, self.feedback, self.strain = np.zeros(m), np.zeros(m), np.zeros(m)
        self.least, self.most = np.zeros(m), np.zeros(m)
