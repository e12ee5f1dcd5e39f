"""A stop keeps the limits while what carries the arm still moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.control.chain import Gains, Horizons, JointSum
from hapticd.control.force_control import Box, ForceControl
from hapticd.control.limits import Limits
from hapticd.control.twin import CartesianTwin
from hapticd.machines.giant.kinematics import points
from hapticd.machines.giant.names import PPU_JOINTS
from hapticd.models import Array, Robot
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.safety import Reaction, Verdict
from hapticd.testing.bench import Bench
from hapticd.testing.copies import in_a_copy

DT = 1e-3
LIMITS = Limits(
    np.array([-np.inf, 0.45, -2.2, 0.1, -0.9, -1.2]),
    np.array([np.inf, 2.4, 1.2, 1.15, 2.2, 1.2]),
    np.array([2.5, 2.5, 3.0, 3.0, 4.0, 5.0]),
    np.array([25.0, 25.0, 35.0, 40.0, 60.0, 90.0]),
)
TORQUE = np.array([260.0, 260.0, 110.0, 110.0, 40.0, 40.0])
ROTOR = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15])
POSTURE = np.array([0.3, 1.4, -0.67, 0.6, 0.5, 0.1])


@dataclass
class Gantry:
    """Carries the arm along x, and brakes."""

    q: Array = field(default_factory=lambda: np.zeros(2))
    qd: Array = field(default_factory=lambda: np.array([0.6, 0.0]))
    qdd: Array = field(default_factory=lambda: np.zeros(2))

    def brake(self) -> None:
        self.qdd[0] = max(-3.0, -self.qd[0] / DT)
        self.q[0] += DT * self.qd[0] + 0.5 * DT**2 * self.qdd[0]
        self.qd[0] += DT * self.qdd[0]


@dataclass
class Wall:
    """A frame of an arm that stands in the room while the gantry carries the arm towards a wall."""

    control: ForceControl
    gantry: Gantry
    robot: Robot
    frame: str
    at: float

    @property
    def gap(self) -> float:
        """From the frame to the wall [m]."""
        x = float(self.robot.placement(self.control.q, self.frame)[0, 3])
        return self.at - float(self.gantry.q[0]) - x

    def tick(self, stop: Callable[[ForceControl], bool]) -> bool:
        control, ability = self.control, self.control.ability
        assert ability
        control.arm.update()
        model, data = self.robot.model, self.robot.data
        model.gravity.linear = np.array([-self.gantry.qdd[0], 0.0, -9.81])
        q = self.robot.configuration(control.q)
        M = pin.crba(model, data, q)
        ability.inertia[:] = np.triu(M) + np.triu(M, 1).T + np.diag(ROTOR)
        ability.load[:] = pin.nonLinearEffects(model, data, q, control.qd)
        ability.least[:], ability.most[:] = -TORQUE, TORQUE
        done = stop(control)
        self.torque = ability.inertia @ control.qdd + ability.load
        control.advance()
        self.gantry.brake()
        return done


def near_a_wall(frame: str, gap: float) -> Wall:
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(PPU_JOINTS)
    at = float(robot.placement(POSTURE, frame)[0, 3]) + gap
    gantry = Gantry()
    control = ForceControl(
        robot,
        LIMITS,
        CartesianTwin(4.0, 0.06, 8.0, 0.25, (3.0, 8.0), (60.0, 200.0)),
        [JointSum((0, 0, 0, 1, 1, 0), 0.6, np.pi - 0.6)],
        [Box(frame, (-2.2, -2.6, -1.28), (at, 2.6, -0.7))],
        Gains(100.0, 100.0, 20.0, 20.0),
        "gauss",
        DT,
        Horizons(5e-3, 15e-3),
        gantry,
        limited=True,
    )
    control.reset(POSTURE)
    J = (
        np.array(
            [
                (robot.placement(POSTURE + e, frame) - robot.placement(POSTURE - e, frame))[:3, 3]
                for e in 1e-6 * np.eye(6)
            ]
        ).T
        / 2e-6
    )
    control.qd[:] = np.linalg.lstsq(J, np.array([-gantry.qd[0], 0.0, 0.0]), rcond=None)[0]
    return Wall(control, gantry, robot, frame, at)


def each_for_itself(control: ForceControl) -> bool:
    control.brake()
    return False


@pytest.mark.parametrize("frame", ["handle", "joint_4"])
def test_a_stop_keeps_boxes_joints_and_torques_while_the_gantry_moves_on(frame: str) -> None:
    wall, alone = near_a_wall(frame, 5e-3), near_a_wall(frame, 5e-3)
    least = worst = np.inf
    for _ in range(400):
        assert wall.tick(ForceControl.stop)
        alone.tick(each_for_itself)
        least, worst = min(least, wall.gap), min(worst, alone.gap)
        q = wall.control.q
        assert (q[1:] < LIMITS.upper[1:]).all() and (q[1:] > LIMITS.lower[1:]).all()
        assert 0.6 < q[3] + q[4] < np.pi - 0.6
        assert (np.abs(wall.torque) < TORQUE * (1.0 + 1e-6)).all()
    assert least > -1e-3  # the wall is held
    assert worst < -0.03  # which is not what each joint would do
    assert np.abs(wall.control.qd).max() < 1e-3  # at rest


def test_without_anything_in_the_way_each_joint_brakes_as_it_is_rated() -> None:
    wall = near_a_wall("handle", 1.0)
    wall.gantry.qd[:] = 0.0
    wall.control.qd[:] = [0.1, -0.1, 0.2, 0.05, -0.3, 0.4]
    before = wall.control.qd.copy()
    wall.tick(ForceControl.stop)
    np.testing.assert_allclose(wall.control.qdd, -np.sign(before) * LIMITS.acceleration, rtol=1e-6)


def test_what_stops_outside_its_box_is_not_pulled_back() -> None:
    wall = near_a_wall("handle", -0.02)
    wall.gantry.qd[:], wall.control.qd[:] = 0.0, 0.0
    for _ in range(50):
        assert wall.tick(ForceControl.stop)
    assert wall.gap == pytest.approx(-0.02, abs=1e-9)


RUSH = 14100
"""Tick of the default walk at which the gantry carries the elbow along its wall at 0.6 m/s."""


@pytest.fixture(scope="module")
def rushing() -> Bench:
    bench = Bench(config.load("giant"))
    bench.run(RUSH)
    return bench


def passed(bench: Bench) -> float:
    """How far the elbow goes beyond its box from a release of the dead-man switch until it rests [m]."""
    worst = -np.inf
    bench.press(False)
    for _ in range(600):
        bench.run(1)
        _, elbow = points(bench.plant.arm.q, bench.plant.ppu.position)
        worst = max(worst, elbow[0] - 2.2)
    assert bench.mode is Mode.STOPPED
    return worst


@in_a_copy
def test_a_stop_in_full_motion_keeps_the_elbow_in_its_box(rushing: Bench) -> None:
    assert passed(rushing) < 0.01
    assert rushing.reason == "dead_man"


@pytest.mark.parametrize("silent", ["imu_carriage", "ppu_y"])
@in_a_copy
def test_a_stop_that_cannot_know_where_the_gantry_goes_lets_each_axis_brake(
    rushing: Bench, silent: str
) -> None:
    rushing.nodes[silent].silent = True
    rushing.run(1)
    rendering = rushing.cycle.machine._rendering  # type: ignore[attr-defined]
    rendering.coordinated = True
    assert passed(rushing) > 0.015  # where it stops together it passes by less than 0.01
    assert not rendering.coordinated


TILTED = 17300
"""Tick of the default walk at which the hand turns the handle against its tilt."""


@in_a_copy
def test_who_presses_against_a_limit_is_held_there_by_a_stop(rushing: Bench) -> None:
    """Without what the hand pulls with, motors yield by torque / gain: 34 mrad here."""
    bench = rushing
    bench.run(TILTED - bench.tick_index)
    bench.press(False)
    worst = -np.inf
    for _ in range(600):
        bench.run(1)
        q = bench.plant.arm.q
        worst = max(worst, 0.6 - (q[3] + q[4]))
    assert bench.mode is Mode.STOPPED
    assert worst < 5e-3


def lies(bench: Bench, force: float) -> float:
    """From now on the force sensor shows this much more along x; how far joints yield in a hold [rad]."""
    sense, felt = bench.plant._sense, bench.nodes["force_torque"].fields["wrench"]

    def lying() -> None:
        sense()
        felt[0] += force

    bench.plant._sense = lying
    bench.cycle.stops.take(Verdict(Reaction.HOLD, "test", "a controlled stop"), bench.tick_index)
    control, yields = bench.cycle.machine.force_control, 0.0  # type: ignore[attr-defined]
    for _ in range(700):
        bench.run(1)
        yields = max(yields, np.abs(bench.plant.arm.q - control.q).max())
    assert bench.mode is Mode.HOLDING
    return yields


@pytest.mark.parametrize(("force", "believed"), [(0.0, True), (60.0, False), (400.0, False)])
@in_a_copy
def test_a_stop_believes_of_the_wrench_what_the_springs_show(
    rushing: Bench, force: float, believed: bool
) -> None:
    """A sensor that lies pushes no harder than the hand, and is soon not heard any more."""
    yields = lies(rushing, force)
    held = np.linalg.norm(rushing.cycle.machine._rendering.wrench[:3])  # type: ignore[attr-defined]
    if believed:
        assert yields < 0.005 and held > 50.0
    else:
        assert yields < 0.04 and held < 1e-3  # as without any sensor
