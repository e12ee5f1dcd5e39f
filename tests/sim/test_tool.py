"""What the sensors at a tool feel, by the momentum of its parts."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.sim.tool import SensedTool, Tool

TOOL = Tool(0.9, (0.01, -0.02, 0.05), (2e-3, 3e-3, 1e-3))
PLACE, UNIT = (0.0, 0.01, -0.03), (0.02, 0.0, 0.04)
STEP = 1e-4


class Swinging:
    """A frame that moves as a product of smooth turns and shifts."""

    def __init__(self) -> None:
        self.rotation, self.twist, self.acceleration = np.eye(3), np.zeros(6), np.zeros(6)

    @staticmethod
    def pose(t: float) -> tuple[np.ndarray, np.ndarray]:
        R = pin.exp3(np.array([0.3, -0.5, 0.2]) * np.sin(3 * t)) @ pin.exp3(np.array([0.1, 0.8, -0.4]) * t)
        return R, np.array([np.sin(2 * t), 0.3 * t * t, np.cos(t)])

    def at(self, t: float) -> None:
        (R0, p0), (R1, p1), (R2, p2) = (self.pose(t + k * STEP) for k in (-1, 0, 1))
        before, after = pin.log3(R1 @ R0.T) / STEP, pin.log3(R2 @ R1.T) / STEP
        self.rotation[:] = R1
        self.twist[:3], self.twist[3:] = (p2 - p0) / (2 * STEP), 0.5 * (before + after)
        self.acceleration[:3], self.acceleration[3:] = (p2 - 2 * p1 + p0) / STEP**2, (after - before) / STEP


def momentum(axes: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linear and angular momentum of the tool about the origin, and its centre, by finite differences."""
    (R0, p0), (R1, p1) = Swinging.pose(t - STEP), Swinging.pose(t + STEP)
    centre = np.array(PLACE) + TOOL.centre
    c0, c1 = p0 + R0 @ axes @ centre, p1 + R1 @ axes @ centre
    R, c = Swinging.pose(t)[0] @ axes, 0.5 * (c0 + c1)
    linear = TOOL.mass * (c1 - c0) / (2 * STEP)
    spin = R @ (TOOL.inertia * (R.T @ pin.log3(R1 @ R0.T) / (2 * STEP)))
    return linear, np.cross(c, linear) + spin, c


@pytest.mark.parametrize("turn", [np.zeros(3), np.array([0.4, -1.0, 0.7])])
def test_what_the_sensor_feels_is_what_the_tools_momentum_needs(turn: np.ndarray) -> None:
    axes, frame, wrench = pin.exp3(turn), Swinging(), np.array([5.0, -3.0, 8.0, 0.2, 0.4, -0.1])
    tool = SensedTool(TOOL, PLACE, frame, wrench, axes, UNIT)
    gravity = np.array([0.1, 0.0, -9.81])
    tool.base[:] = -gravity
    d = 1e-3
    for t in (0.2, 0.7, 1.3):
        frame.at(t)
        tool.update()
        (p0, L0, _), (p1, L1, _), (_, _, c) = (momentum(axes, x) for x in (t - d, t + d, t))
        R, H = frame.rotation @ axes, frame.pose(t)[1]
        force = wrench[:3] + TOOL.mass * gravity - (p1 - p0) / (2 * d)
        about_origin = np.cross(H, wrench[:3]) + wrench[3:] + np.cross(c, TOOL.mass * gravity)
        about_origin -= (L1 - L0) / (2 * d)
        torque = about_origin - np.cross(H + R @ PLACE, force)
        np.testing.assert_allclose(tool.felt, [*(R.T @ force), *(R.T @ torque)], atol=2e-5)


def test_the_inertial_unit_feels_the_acceleration_of_its_own_place() -> None:
    axes, frame = pin.exp3(np.array([0.4, -1.0, 0.7])), Swinging()
    tool = SensedTool(TOOL, PLACE, frame, np.zeros(6), axes, UNIT)
    tool.base[:] = (0.0, 0.0, 9.81)
    frame.at(0.7)
    tool.update()
    d = 1e-3
    before, now, after = (p + R @ axes @ UNIT for R, p in map(frame.pose, (0.7 - d, 0.7, 0.7 + d)))
    R = frame.rotation @ axes
    np.testing.assert_allclose(
        tool.specific, R.T @ ((after - 2 * now + before) / d**2 + tool.base), atol=1e-4
    )
    np.testing.assert_allclose(tool.omega, R.T @ frame.twist[3:], atol=1e-12)
