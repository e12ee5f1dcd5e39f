"""Kinematics of the five-bar linkage; a URDF cannot close its loop, so the model holds the left arm alone."""

import numpy as np
from hapticd.runtime.core.torque_axes import TorqueAxes

MOTORS = ("left", "right")


class Linkage:
    """Two motors, two arms of equal links, one handle; ``motors`` says what they may do."""

    def __init__(self, robot, base: float) -> None:
        straight = np.zeros(robot.nv)
        self.upper = float(np.linalg.norm(robot.placement(straight, "elbow")[:3, 3]))
        self._fore = float(np.linalg.norm(robot.placement(straight, "handle")[:3, 3])) - self.upper
        self._at = np.array([[0.0, 0.0], [base, 0.0]])
        low, high = float(robot.lower[0]), float(robot.upper[0])
        most = [float(robot.velocity[0])] * 2, [float(robot.effort[0])] * 2
        self.motors = TorqueAxes(MOTORS, (low, np.pi - high), (high, np.pi - low), *most)

    def at(self, q):
        """Handle (2,) [m] and Jacobian (2, 2) for motor angles (2,) [rad]."""
        ways = self.upper * np.stack([np.cos(q), np.sin(q)], axis=1)
        elbows = self._at + ways
        apart = elbows[1] - elbows[0]
        height = np.sqrt(self._fore**2 / (apart @ apart) - 0.25)
        handle = elbows.mean(axis=0) + height * np.array([-apart[1], apart[0]])
        forearms = handle - elbows  # they keep their lengths: forearm . (handle - elbow)' = 0
        turned = np.stack([-ways[:, 1], ways[:, 0]], axis=1)
        return handle, np.linalg.solve(forearms, np.diag((forearms * turned).sum(axis=1)))
