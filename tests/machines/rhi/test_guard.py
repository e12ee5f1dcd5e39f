"""Joint limits: the bounds against the dynamics, the guard against quadprog, and the closed loop."""

import numpy as np
import pytest
import quadprog  # type: ignore[import-untyped]
from hapticd.machines.rhi.guard import KEPT, ROOM, STOP, Span
from hapticd.machines.rhi.nullspace import Gains, NullSpace, null_projection
from hapticd.machines.rhi.redundant import RedundantArm
from hapticd.models import Array
from hapticd.sim.rigid import RigidArm

from .rhi_device import LIMIT, ROTOR, U, four_dof, home_shape
from .test_contact_aware import FREE, FRICTION

SPAN = Span((-1.0, -0.8, -1.8, -2.2), (2.0, 2.6, 1.8, 2.2), 0.15)
SOFT, HORIZON = 0.002, 0.07
"""Of csrc/guard.c."""


def guarded(arm: RedundantArm, gains: Gains | None = None) -> NullSpace:
    gains = gains or Gains(20.0, 0.1, 2.0, 0.0, FRICTION)
    return NullSpace(arm, LIMIT, home_shape(arm), gains, U, SPAN)


def at_random(space: NullSpace, arm: RedundantArm, rng: np.random.Generator, moving: float = 1.0) -> Array:
    """Somewhere inside, often next to limits; returns M^-1 N."""
    lower, upper = np.array(SPAN.lower), np.array(SPAN.upper)
    while True:
        share = np.clip(rng.uniform(-0.2, 1.2, arm.n), 0.01, 0.99)
        arm.q[:], arm.qd[:] = lower + share * (upper - lower), moving * rng.standard_normal(arm.n)
        arm.update()
        if np.linalg.cond(arm.J) < 20.0 and space.secondary(rng.uniform()):
            return np.linalg.solve(arm.M, null_projection(arm.J, arm.M))


def test_bounds_are_on_the_accelerations_of_a_posture_whose_hand_goes_on() -> None:
    """On their floor, a motor arrives at its limit one horizon ahead; bias and friction are part of it."""
    arm = four_dof()
    space, rng = guarded(arm), np.random.default_rng(1)
    for _ in range(100):
        at_random(space, arm, rng)
        guard = space.guard
        tau = rng.standard_normal(arm.n)
        # the hand's force is such that it goes on: J qdd + drift = 0
        load = tau - arm.bias - np.array(FRICTION) * arm.qd
        Minv = np.linalg.inv(arm.M)
        force = -np.linalg.solve(arm.J @ Minv @ arm.J.T, arm.J @ Minv @ load + arm.drift)
        qdd = Minv @ (load + arm.J.T @ force)
        ahead = arm.q + HORIZON * arm.qd + 0.5 * HORIZON**2 * qdd
        scale = 2.0 / HORIZON**2 * np.diag(arm.M)
        kept = KEPT * SPAN.margin
        torque = guard.rows @ tau
        np.testing.assert_allclose(torque - guard.floor, scale * (ahead - SPAN.lower - kept), atol=1e-8)
        np.testing.assert_allclose(
            guard.ceiling - torque, scale * (np.array(SPAN.upper) - kept - ahead), atol=1e-8
        )


def least_change(space: NullSpace, arm: RedundantArm, tau: Array) -> tuple[float, Array]:
    """min a^T M^-1 a / 2 + sum_i slack_i^2 / (2 soft M_ii) over the null space, by quadprog: cost and a."""
    guard, n = space.guard, arm.n
    null = np.linalg.svd(null_projection(arm.J, arm.M))[0][:, : n - arm.m]
    G = np.zeros((2 + n, 2 + n))
    G[:2, :2] = null.T @ np.linalg.solve(arm.M, null)
    G[2:, 2:] = np.diag(1.0 / (SOFT * np.diag(arm.M)))
    C = np.block([[guard.rows @ null, np.eye(n)], [-guard.rows @ null, np.eye(n)]]).T
    own = guard.rows @ tau
    b = np.concatenate([guard.floor - own, own - guard.ceiling])
    found = quadprog.solve_qp(G, np.zeros(2 + n), C, b)
    return float(found[1]), null @ found[0][:2]


def test_what_the_guard_adds_is_the_least_change_and_moves_no_hand() -> None:
    arm = four_dof()
    space, rng = guarded(arm), np.random.default_rng(2)
    acted = 0
    for _ in range(400):
        mobile = at_random(space, arm, rng, 2.0)
        guard = space.guard
        np.testing.assert_allclose(guard.rows, np.diag(arm.M)[:, None] * mobile, atol=1e-9)
        tau = 0.3 * rng.standard_normal(arm.n)
        add = guard.hold(tau).copy()
        assert np.abs(arm.J @ np.linalg.solve(arm.M, add)).max() < 1e-8 * (1.0 + np.abs(add).max())
        after = guard.rows @ (tau + add)
        lack = np.maximum(guard.floor - after, 0.0) + np.maximum(after - guard.ceiling, 0.0)
        if np.max(lack / SOFT / LIMIT) > 19.0:
            continue  # at its clamp
        cost = 0.5 * add @ np.linalg.solve(arm.M, add) + np.sum(lack**2 / np.diag(arm.M)) / (2.0 * SOFT)
        least, optimum = least_change(space, arm, tau)
        assert least - 1e-9 <= cost <= 1.01 * least + 1e-6
        np.testing.assert_allclose(add, optimum, atol=0.02 * (1.0 + np.abs(optimum).max()))
        acted += bool(np.abs(add).max() > 1e-3)
    assert acted > 60


def test_far_from_limits_there_is_no_guard() -> None:
    arm = four_dof()
    space = guarded(arm)
    arm.q[:], arm.qd[:] = FREE, 0.1
    arm.update()
    assert space.secondary(1.0)
    assert not space.guard.hold(np.full(4, 0.1)).any()
    assert not space.guard.avoid().any() and not space.guard.stop.any()


def left(arm: RedundantArm, q: Array) -> float:
    """log(det A / det A_p) / 2, written down once more."""
    J = arm.at(q).J / LIMIT
    room = np.minimum(q - SPAN.lower, np.array(SPAN.upper) - q)
    s = np.clip((room / SPAN.margin - KEPT) / (ROOM - KEPT), 0.0, 1.0)
    p = 0.02 + 0.98 * s**2 * (3.0 - 2.0 * s)
    return float(np.linalg.slogdet(J @ J.T)[1] - np.linalg.slogdet((J * p) @ J.T)[1]) / 2.0


def test_the_way_out_of_dead_ends_is_the_gradient_of_what_the_hand_would_lose() -> None:
    arm = four_dof()
    space, rng = guarded(arm), np.random.default_rng(3)
    h, turned = 1e-6, 0
    for _ in range(100):
        at_random(space, arm, rng)
        q = arm.q.copy()
        gradient = space.guard.avoid().copy()
        difference = [(left(arm, q + e) - left(arm, q - e)) / (2 * h) for e in h * np.eye(4)]
        np.testing.assert_allclose(gradient, difference, atol=1e-5 * (1.0 + np.abs(gradient).max()))
        turned += bool(gradient.any())
    assert turned > 50


def test_the_end_stop_pushes_back_in_its_zone_and_no_harder_than_its_motor_can() -> None:
    arm = four_dof()
    space = guarded(arm)
    zone = STOP * SPAN.margin
    for depth, share in ((-0.1, 0.0), (0.15, 0.25), (0.3, 0.5), (0.6, 1.0), (3.0, 1.0)):
        for ends, side in ((SPAN.lower, 1.0), (SPAN.upper, -1.0)):
            arm.q[:], arm.qd[:] = FREE, 0.0
            arm.q[2] = ends[2] + side * zone * (1.0 - depth)
            arm.update()
            assert space.secondary(0.5)
            np.testing.assert_allclose(space.guard.stop, [0.0, 0.0, side * share * LIMIT[2], 0.0], atol=1e-12)


def test_the_end_stop_meets_a_motor_too_fast_to_come_to_rest_and_no_other() -> None:
    """It brakes what goes towards the limit faster than the way to the zone in FORESEEN, and nothing else."""
    arm = four_dof()
    space = guarded(arm)
    foreseen = 0.05
    for rate, share in ((-1.0, 0.0), (0.9, 0.0), (1.4, 0.4), (9.0, 1.0)):
        for ends, side in ((SPAN.lower, 1.0), (SPAN.upper, -1.0)):
            arm.q[:], arm.qd[:] = FREE, 0.0
            arm.q[2] = ends[2] + side * (STOP * SPAN.margin + foreseen * 1.0)
            arm.qd[2] = -side * rate
            arm.update()
            assert space.secondary(0.5)
            np.testing.assert_allclose(space.guard.stop[2], side * share * LIMIT[2], atol=1e-12)


@pytest.mark.parametrize("motor", range(4))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_pull_across_a_limit_stops_in_front_of_it(motor: int, side: float) -> None:
    """A target 1 rad beyond, and a hand that holds the handle: the posture turns, and stays inside."""
    arm = four_dof()
    space = guarded(arm, Gains(1e-6, 0.1, 2.0, 10.0, FRICTION))
    ends = SPAN.upper if side > 0.0 else SPAN.lower
    space.free[:] = FREE
    space.free[motor] = ends[motor] + side
    plant = _plant()
    plant.reset(FREE)
    held = plant.position.copy()
    nearest = np.inf
    for _ in range(1500):
        arm.q[:], arm.qd[:] = plant.q, plant.qd
        arm.update()
        assert space.secondary(1.0)
        space.want([0.0, 0.0])
        space.compose(1.0)
        for _ in range(2):
            push = 3000.0 * (held - plant.position) - 25.0 * plant.velocity
            plant.step(space.torque, [False] * 4, push, 5e-4)
        room = np.minimum(plant.q - SPAN.lower, np.array(SPAN.upper) - plant.q)
        nearest = min(nearest, float(room.min()))
    assert nearest > STOP * SPAN.margin  # the posture alone keeps it, not the end stop
    assert side * (plant.q[motor] - FREE[motor]) > 0.1  # it went there
    assert np.linalg.norm(plant.position - held) < 1e-3


def _plant() -> RigidArm:
    from hapticd.machines.rhi import planar
    from hapticd.models import Robot

    robot = Robot.from_urdf(planar.urdf("rhi", planar.FOUR_DOF), "rhi.urdf")
    T = planar.FOUR_DOF_TRANSMISSION
    return RigidArm(robot, planar.HANDLE, T, ROTOR, np.array(FRICTION), np.full(4, 25.0))
