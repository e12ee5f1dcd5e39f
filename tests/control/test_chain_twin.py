"""A chain as the twin: dynamics against pinocchio and closed forms, locks against what a door does."""

from math import cos, exp, pi, sin
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.chain import CAUGHT, FREE, LOCKED
from hapticd.control.chain_twin import ChainTwin, Detent
from hapticd.machines.rendering.sections import ChainTwin as Section
from hapticd.machines.rendering.twin import chain_twin, mechanism_of, robot_of
from hapticd.models import DhRow
from hapticd.models.dh import forward
from hapticd.models.dh_robot import END, Body, from_dh
from hapticd.runtime.configuration import config

TWINS = ("door", "excavator", "panda")
HANDLE = pin.rpy.rpyToMatrix(0.3, 2.1, -0.7)
PLACE = np.array([0.4, -0.8, -1.1])
DT = 1e-3


def section(name: str) -> Section:
    loaded: Any = config.load(f"giant with {name}").config
    found = loaded.giant.twin
    assert isinstance(found, Section)
    return found


def at_state(twin: ChainTwin, seed: int) -> np.random.Generator:
    rng = np.random.default_rng(seed)
    n = len(twin.q)
    twin.q[:] = rng.uniform(-1.0, 1.0, n)
    twin.qd[:] = rng.uniform(-1.0, 1.0, n)
    twin.place()
    return rng


@pytest.mark.parametrize("name", TWINS)
@pytest.mark.parametrize(("gravity", "share"), [(0.0, 1.0), (9.81, 1.0), (9.81, 0.3)])
def test_the_equation_of_motion_is_pinocchios(name: str, gravity: float, share: float) -> None:
    described = section(name)
    robot = robot_of(described)
    mechanism = mechanism_of(described, robot)
    end = described.end or END
    turned = pin.rpy.rpyToMatrix(0.2, -0.4, 1.0)
    twin = ChainTwin(robot, end, mechanism, turned, gravity)
    twin.reset(PLACE, HANDLE)
    for seed in range(5):
        rng = at_state(twin, seed)
        wrench = rng.standard_normal(6)
        twin.update(wrench, share)
        R, model = twin.base[:3, :3], robot.model.copy()
        data, frame = model.createData(), robot.frame(end)
        model.gravity.linear = R.T @ [0.0, 0.0, -share * gravity]
        q = robot.configuration(twin.q).copy()
        M = np.triu(pin.crba(model, data, q))
        M = M + np.triu(M, 1).T + np.diag(mechanism.inertia)
        J = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
        J = np.vstack([R @ J[:3], R @ J[3:]])
        torque = J.T @ wrench - pin.nonLinearEffects(model, data, q, twin.qd) - mechanism.damping * twin.qd
        torque += share * (mechanism.drive + mechanism.stiffness * (mechanism.rest - twin.q))
        np.testing.assert_allclose(twin.M, M, atol=1e-10)
        np.testing.assert_allclose(twin.force, torque, atol=1e-9)
        np.testing.assert_allclose(twin.J, J, atol=1e-12)
        np.testing.assert_allclose(twin.twist, J @ twin.qd, atol=1e-12)


@pytest.mark.parametrize("name", TWINS)
def test_its_end_begins_at_the_handle_and_keeps_its_grip(name: str) -> None:
    described = section(name)
    twin = chain_twin(described)
    at_state(twin, 1)
    twin.reset(PLACE, HANDLE)
    np.testing.assert_allclose(twin.position, PLACE, atol=1e-12)
    np.testing.assert_allclose(twin.rotation, HANDLE, atol=1e-12)
    np.testing.assert_allclose(twin.base[:3, 2], [0.0, 0.0, 1.0], atol=1e-12)  # it stands upright
    robot, first = robot_of(described), twin.q.copy()
    end = described.end or END
    grip = (twin.base @ robot.placement(first, end))[:3, :3].T @ HANDLE
    at_state(twin, 2)
    T = twin.base @ robot.placement(twin.q, end)
    np.testing.assert_allclose(twin.position, T[:3, 3], atol=1e-12)
    np.testing.assert_allclose(twin.rotation, T[:3, :3] @ grip, atol=1e-12)


def test_its_base_turns_with_the_direction_in_which_the_handle_points() -> None:
    twin = chain_twin(section("excavator"))
    axes = []
    for yaw in (0.0, 1.3):
        twin.reset(PLACE, pin.utils.rotate("z", yaw) @ HANDLE)
        axes.append(twin.base[:3, :3].copy())
    np.testing.assert_allclose(axes[1], pin.utils.rotate("z", 1.3) @ axes[0], atol=1e-12)
    twin.reset(PLACE, np.eye(3))  # an upright axis points nowhere
    np.testing.assert_allclose(twin.base[:3, :3], pin.utils.rotate("z", pi), atol=1e-12)


def test_a_table_gives_the_poses_of_its_rows_and_its_links_their_weight() -> None:
    rows = (
        DhRow("lift", "prismatic", 0.3, 0.2, 0.1, 0.7),
        DhRow("turn", "revolute", -0.4, 0.5, 0.3, -1.1),
        DhRow("tip", "revolute", 0.9, 0.0, 0.2, 0.4),
    )
    body = Body(2.0, (0.1, -0.2, 0.3), (0.02, 0.03, 0.04))
    robot = from_dh(rows, (Body(), Body(), body))
    for q in np.random.default_rng(3).uniform(-1.0, 1.0, (5, 3)):
        T = forward(np.eye(4), rows, q)[-1]
        np.testing.assert_allclose(robot.placement(q, END), T, atol=1e-12)
        energy = pin.computePotentialEnergy(robot.model, robot.data, robot.configuration(q))
        centre = T[:3, :3] @ body.centre + T[:3, 3]
        assert energy == pytest.approx(2.0 * 9.81 * centre[2], abs=1e-9)


def test_the_doors_motion_is_that_of_two_inertias_on_levers() -> None:
    """6 q1'' = u1 - 2 - 3 q1 - 3 q1' and .06 q2'' = u2 - .6 - 2.5 q2 - .3 q2', u from the levers."""
    twin = chain_twin(section("door"))
    twin.reset(PLACE, HANDLE)
    rng = np.random.default_rng(4)
    R = twin.base[:3, :3]
    for q1, q2, v1, v2 in rng.uniform(-0.6, 1.2, (6, 4)):
        twin.q[:], twin.qd[:] = (q1, q2), (v1, v2)
        twin.place()
        wrench = rng.standard_normal(6)
        twin.update(wrench)
        force, torque = R.T @ wrench[:3], R.T @ wrench[3:]
        reach = 0.8 - 0.12 * cos(q2)  # from the hinge's axis to the hand, along the leaf
        along, across = np.array([cos(q1), sin(q1), 0.0]), np.array([-sin(q1), cos(q1), 0.0])
        down = np.array([0.0, 0.0, -1.0])
        u1 = reach * (across @ force) + torque[2]
        u2 = 0.12 * (sin(q2) * along + cos(q2) * down) @ force - across @ torque
        expected = [u1 - 2.0 - 3.0 * q1 - 3.0 * v1, u2 - 0.6 - 2.5 * q2 - 0.3 * v2]
        np.testing.assert_allclose(twin.force, expected, atol=1e-12)
        np.testing.assert_allclose(twin.M, np.diag([6.0, 0.06]), atol=1e-12)


@pytest.mark.parametrize("name", TWINS)
def test_without_damping_the_work_of_the_hand_is_the_gain_of_energy(name: str) -> None:
    described = section(name)
    twin = chain_twin(described)
    robot = robot_of(described)
    mechanism = mechanism_of(described, robot)
    twin.damping[:] = 0.0
    twin.reset(PLACE, HANDLE)

    def energy() -> float:
        kinetic = 0.5 * twin.qd @ twin.M @ twin.qd
        away = twin.q - mechanism.rest
        return float(kinetic + 0.5 * mechanism.stiffness @ away**2 - mechanism.drive @ twin.q)

    work, dt = 0.0, 1e-4
    twin.update(np.zeros(6))
    begin = energy()
    qdd = np.zeros(len(twin.q))
    rate = 0.0
    for k in range(4000):
        wrench = np.array([6.0, -3.0, 4.0, 0.2, -0.3, 0.1]) * cos(8.0 * k * dt)
        twin.update(wrench)
        qdd[:] = np.linalg.solve(twin.M, twin.force)
        before = float(wrench @ twin.twist)
        twin.integrate(qdd, dt)
        work += 0.5 * dt * (before + float(wrench @ twin.twist))
        rate = max(rate, float(np.abs(twin.qd).max()))
    twin.update(np.zeros(6))
    assert rate > 0.2  # it did move
    assert energy() - begin == pytest.approx(work, rel=2e-3)


def test_a_detent_draws_to_its_place_as_a_smooth_well_does() -> None:
    detent = Detent(0, 0.3, 0.5, 0.05)
    depth = 0.5 * 0.05 * exp(0.5)

    def potential(q: float) -> float:
        return -depth * exp(-0.5 * ((q - 0.3) / 0.05) ** 2)

    for q in np.linspace(0.1, 0.5, 9).tolist():
        slope = (potential(q + 1e-6) - potential(q - 1e-6)) / 2e-6
        assert detent.pull(q) == pytest.approx(-slope, abs=1e-8)
    pulls = [detent.pull(q) for q in np.linspace(0.1, 0.5, 4001).tolist()]
    assert max(pulls) == pytest.approx(0.5, rel=1e-5)
    assert detent.pull(0.25) == pytest.approx(0.5)


def test_the_lock_opens_by_the_handle_and_catches_when_it_is_let_go_of() -> None:
    twin = chain_twin(section("door"))
    twin.reset(PLACE, HANDLE)
    assert twin.held is not None

    def look(hinge: float, handle: float, rate: float = 0.0) -> int:
        assert twin.held is not None
        twin.q[:], twin.qd[:] = (hinge, handle), (rate, 0.0)
        twin.place()
        twin.update(np.zeros(6))
        assert twin.held[1] == FREE
        return int(twin.held[0])

    assert twin.held[0] == LOCKED  # a door begins shut
    assert look(0.0, 0.34) == LOCKED
    assert look(0.0, 0.36) == FREE
    assert look(0.0, 0.30) == FREE  # the handle has not been let go of
    assert look(0.2, 0.0) == FREE
    assert look(0.031, 0.0) == FREE
    assert look(0.029, 0.2) == FREE  # it is still half pressed
    assert look(0.029, 0.0, -0.3) == CAUGHT
    assert look(0.0005, 0.0, -0.3) == CAUGHT
    assert look(0.0005, 0.0, -0.005) == LOCKED
    twin.reset(PLACE, HANDLE)
    assert twin.held[0] == LOCKED
