"""The rendered dynamics: exact where nothing is in the way, a physical barrier where something is."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.control.chain import FREE, LOCKED, UPPER, Gains, Horizons, JointSum
from hapticd.control.force_control import Box, Detection, ForceControl, Posture
from hapticd.control.limits import Limits
from hapticd.control.twin import CartesianTwin
from hapticd.hqp import Status
from hapticd.machines.rendering.twin import chain_twin
from hapticd.models import Robot
from hapticd.runtime.configuration import config

DT = 1e-3
POSTURE = np.array([0.3, 1.4, -0.67, 0.6, 0.5, 0.1])
LIMITS = Limits(
    np.array([-np.inf, 0.45, -2.2, -0.6, -0.9, -1.2]),
    np.array([np.inf, 2.4, 1.2, 1.15, 2.2, 1.2]),
    np.array([2.5, 2.5, 3.0, 3.0, 4.0, 5.0]),
    np.array([25.0, 25.0, 35.0, 40.0, 60.0, 90.0]),
)


@dataclass
class StillPpu:
    q: np.ndarray = field(default_factory=lambda: np.zeros(2))
    qd: np.ndarray = field(default_factory=lambda: np.zeros(2))
    qdd: np.ndarray = field(default_factory=lambda: np.zeros(2))


def make(detection: Detection = "redetect", ppu: StillPpu | None = None) -> ForceControl:
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    control = ForceControl(
        robot,
        LIMITS,
        CartesianTwin(4.0, 0.06, 8.0, 0.25, (3.0, 8.0), (60.0, 200.0)),
        [JointSum((0, 0, 0, 1, 1, 0), 0.6, np.pi - 0.6)],
        [Box(frame, (-2.2, -2.6, -1.28), (2.2, 2.6, -0.7)) for frame in ("handle", "joint_4")],
        Gains(100.0, 100.0, 20.0, 20.0),
        detection,
        DT,
        Horizons(5e-3, 15e-3),
        ppu,
    )
    control.reset(POSTURE)
    return control


def tick(control: ForceControl, wrench: np.ndarray) -> None:
    control.prepare(wrench)
    assert control.assemble()
    assert control.optimise()
    control.advance()


def test_without_a_limit_the_operator_feels_exactly_the_twin() -> None:
    control = make()
    wrench = np.array([3.0, -2.0, 1.0, 0.05, -0.1, 0.02])
    mass, drag = np.repeat([4.0, 0.06], 3), np.repeat([8.0, 0.25], 3)
    for _ in range(200):
        before = control.twin.twist.copy()
        tick(control, wrench)
        acceleration = (control.twin.twist - before) / DT
        np.testing.assert_allclose(mass * acceleration, wrench - drag * before, atol=1e-9)  # (9)
    assert not control.active.any()


def test_the_handle_stays_on_the_twin_while_the_ppu_moves() -> None:
    ppu = StillPpu()
    control = make(ppu=ppu)
    for k in range(1000):
        t = k * DT
        ppu.q[0], ppu.qd[0], ppu.qdd[0] = 0.1 * (1 - np.cos(2 * t)), 0.2 * np.sin(2 * t), 0.4 * np.cos(2 * t)
        tick(control, np.array([0.0, 4.0, 0.0, 0.0, 0.0, 0.0]))
        assert np.abs(control.coupling_error).max() < 2e-5


@pytest.mark.parametrize("detection", ["redetect", "previous", "gauss"])
@pytest.mark.parametrize(
    ("wrench", "joint"),
    [((0, 0, 40, 0, 0, 0), 3), ((0, 0, 0, -2.0, 0, -1.0), None), ((60, 0, 0, 0, 0, 0), None)],
)
def test_pushing_against_limits_keeps_every_limit_and_ends_at_rest(
    detection: Detection, wrench: tuple[float, ...], joint: int | None
) -> None:
    control = make(detection)
    peak = 0.0
    for _ in range(3000):
        tick(control, np.array(wrench, float))
        q, tilt = control.q, control.q[3] + control.q[4]
        assert (q[1:] <= LIMITS.upper[1:] + 1e-4).all() and (q[1:] >= LIMITS.lower[1:] - 1e-4).all()
        assert 0.6 - 8e-3 <= tilt <= np.pi - 0.6 + 8e-3
        assert (np.abs(control.qd) <= LIMITS.velocity * 1.02).all()
        peak = max(peak, float(np.linalg.norm(control.coupling_error[:3])))
    assert peak < 3e-3
    if joint is not None:
        assert control.q[joint] == pytest.approx(LIMITS.upper[joint], abs=1e-6)
        assert control.active[6 + joint] & UPPER


def test_a_limit_pushes_back_like_a_wall_and_lets_the_rest_of_the_twin_move() -> None:
    control = make()
    wrench = np.array([0.0, 0.0, 30.0, 0.0, 0.0, 0.0])
    for _ in range(2500):  # joint 4 comes to its upper limit
        tick(control, wrench)
    assert control.q[3] == pytest.approx(1.15, abs=1e-6)
    start = control.twin.position.copy()
    for _ in range(500):
        tick(control, wrench + np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    moved = control.twin.position - start
    assert moved[0] > 0.02  # sideways it is as free as before
    assert abs(moved[2]) < 0.02


def test_redetection_solves_again_until_no_limit_is_new() -> None:
    control = make()
    wrench = np.array([0.0, 0.0, 60.0, 0.0, 0.0, 0.0])
    most = 0
    for _ in range(2000):
        tick(control, wrench)
        most = max(most, control.solves)
    assert 2 <= most <= 5
    control = make("previous")
    for _ in range(2000):
        tick(control, wrench)
        assert control.solves == 1


@pytest.mark.parametrize("remark", [Status.ITERATION_CAP, Status.REPEATED_SET, Status.NOT_PROVEN])
def test_without_a_full_answer_manipulator_and_twin_brake_at_their_ratings(
    monkeypatch: pytest.MonkeyPatch, remark: Status
) -> None:
    control = make()
    for _ in range(400):
        tick(control, np.array([8.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    speed = np.abs(control.qd).max()
    assert speed > 0.1

    class Failed:
        status, iterations, levels_done = remark, 64, 3
        x = control.solution.x

    monkeypatch.setattr(control._solver, "solve", lambda _: Failed)
    for _ in range(200):
        control.prepare(np.zeros(6))
        assert control.assemble()
        assert not control.optimise()
        assert (np.abs(control.qdd) <= LIMITS.acceleration + 1e-12).all()
        control.advance()
    assert np.abs(control.qd).max() < 1e-9


def test_a_posture_in_the_singularity_cannot_be_prepared() -> None:
    control = make()
    control.reset(np.array([0.3, 1.4, -0.67, 0.5, -0.5, 0.0]))
    control.prepare(np.zeros(6))
    assert not control.assemble()


AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


def arm(n: int) -> Robot:
    """A chain of n joints with links of 0.25 m, and a handle at its end."""
    still = 'rpy="0 0 0"'
    inertia = '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>'
    links = "".join(
        f'<link name="link_{i}"><inertial><origin xyz="0 0 0.12" {still}/><mass value="1"/>{inertia}'
        f'</inertial></link><joint name="joint_{i}" type="revolute"><parent link="link_{i - 1}"/>'
        f'<child link="link_{i}"/><origin xyz="0 0 {0.25 if i > 1 else 0}" {still}/>'
        f'<axis xyz="{AXES["zyyxyzy"[i - 1]]}"/><dynamics damping="0.1"/>'
        '<limit lower="-3" upper="3" effort="100" velocity="3"/></joint>'
        for i in range(1, n + 1)
    )
    tip = (
        f'<link name="handle"/><joint name="tip" type="fixed"><parent link="link_{n}"/>'
        f'<child link="handle"/><origin xyz="0.05 0 0.2" {still}/></joint>'
    )
    text = f'<robot name="arm"><link name="link_0"/>{links}{tip}</robot>'
    return Robot.from_urdf(text, "arm.urdf")


def render(n: int, directions: list[int], home: np.ndarray) -> ForceControl:
    control = ForceControl(
        arm(n),
        Limits(np.full(n, -3.0), np.full(n, 3.0), np.full(n, 3.0), np.full(n, 30.0)),
        CartesianTwin(4.0, 0.06, 8.0, 0.25, (3.0, 8.0), (60.0, 200.0), directions),
        [],
        [],
        Gains(100.0, 100.0, 20.0, 20.0),
        "gauss",
        DT,
        Horizons(5e-3, 15e-3),
        directions=directions,
        posture=Posture(home, 20.0, 9.0),
    )
    control.reset(home)
    return control


HOME_7 = np.array([0.2, 0.7, 1.2, 0.3, 0.6, 0.4, 0.5])


@pytest.mark.parametrize(("n", "directions"), [(3, [0, 1, 2]), (4, [0, 2]), (5, [0, 1, 2]), (7, [*range(6)])])
def test_an_arm_of_any_length_renders_the_directions_that_it_is_asked_for(
    n: int, directions: list[int]
) -> None:
    control = render(n, directions, HOME_7[:n])
    wrench = np.array([1.5, -1.0, 0.8, 0.02, -0.01, 0.03])
    mass, drag = np.repeat([4.0, 0.06], 3)[directions], np.repeat([8.0, 0.25], 3)[directions]
    for _ in range(300):
        before = control.twin.twist[directions].copy()
        tick(control, wrench)
        acceleration = (control.twin.twist[directions] - before) / DT
        np.testing.assert_allclose(mass * acceleration, wrench[directions] - drag * before, atol=1e-8)
    moved = np.abs(control.coupling_error[directions])
    assert moved.max() < 1e-4  # the handle is where the twin is
    still = [i for i in range(6) if i not in directions]
    assert not control.twin.twist[still].any()


def test_the_seventh_joint_returns_to_the_posture_without_moving_the_handle() -> None:
    control = render(7, [*range(6)], HOME_7)
    null = np.linalg.svd(control.handle.J)[2][-1]
    control.reset(HOME_7 + 0.3 * null)
    start, handle = np.abs((control.q - HOME_7) @ null), control.handle.position.copy()
    for _ in range(3000):
        tick(control, np.zeros(6))
    assert np.abs((control.q - HOME_7) @ null) < 0.3 * start
    np.testing.assert_allclose(control.handle.position, handle, atol=1e-4)


def door(detection: Detection) -> ForceControl:
    settings: Any = config.load("giant with door").config
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    control = ForceControl(
        robot,
        LIMITS,
        chain_twin(settings.giant.twin),
        [JointSum((0, 0, 0, 1, 1, 0), 0.6, np.pi - 0.6)],
        [],
        Gains(100.0, 100.0, 20.0, 20.0),
        detection,
        DT,
        Horizons(5e-3, 15e-3),
    )
    control.reset(np.array(settings.simulation.giant.posture))
    return control


@pytest.mark.parametrize("detection", ["redetect", "previous", "gauss"])
def test_a_locked_door_stays_shut_and_its_handle_unlocks_it_under_each_rule(detection: Detection) -> None:
    control = door(detection)

    def push(opening: float, pressing: float, ticks: int) -> None:
        """With these torques in the two joints [N m]."""
        for _ in range(ticks):
            J = control.twin.J
            tick(control, np.linalg.lstsq(J.T, np.array([opening, pressing]), rcond=None)[0])

    push(30.0, 0.0, 300)
    assert abs(control.twin.q[0]) < 1e-9 and control.twin.held is not None and control.twin.held[0] == LOCKED
    push(-30.0, 3.0, 400)  # the handle goes down, the door is pulled
    assert control.twin.q[1] > 0.35 and control.twin.held[0] == FREE
    assert control.twin.q[0] > -1e-6
    push(12.0, 3.0, 400)
    assert control.twin.q[0] > 0.05
    push(0.0, 0.0, 6000)  # let go
    assert control.twin.held[0] == LOCKED and abs(control.twin.q[0]) < 1e-3
    assert control.twin.q[1] == pytest.approx(-0.05, abs=1e-3)
