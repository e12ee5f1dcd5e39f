"""The null-space controller in C against numpy, an equality-constrained QP and the dynamics."""

import numpy as np
import pytest
from hapticd.machines.rhi.hierarchy import Hierarchy
from hapticd.machines.rhi.manipulability import direction, stein, stein_gradient, velocity_ellipsoid
from hapticd.machines.rhi.nullspace import Gains, NullSpace, dynamic_inverse, null_projection
from hapticd.machines.rhi.redundant import RedundantArm

from .rhi_device import LIMIT, U, four_dof, home_shape, narrow, raised_projection
from .test_redundant import spatial

GAINS = Gains(beta=20.0, damping=0.1, cap=np.inf)


@pytest.fixture
def arm() -> RedundantArm:
    return four_dof()


def at_random(arm: RedundantArm, rng: np.random.Generator) -> None:
    arm.q[:], arm.qd[:] = rng.uniform(-2, 2, arm.n), rng.standard_normal(arm.n)
    arm.update()


@pytest.mark.parametrize("make", [four_dof, spatial])
def test_null_space_torque_is_the_nearest_one_that_leaves_the_hand_alone(make: type[RedundantArm]) -> None:
    """Against the QP: min (tau - tau_s)^T M^-1 (tau - tau_s) subject to J M^-1 tau = 0, by its KKT system."""
    arm = make()
    rng = np.random.default_rng(1)
    limit = np.ones(arm.n)
    space = NullSpace(arm, limit, home_shape(four_dof()), GAINS, np.eye(arm.m)[0])
    for _ in range(200):
        at_random(arm, rng)
        if not space.secondary(rng.uniform()) or narrow(arm):
            continue
        n, m = arm.n, arm.m
        Minv = np.linalg.inv(arm.M)
        kkt = np.block([[Minv, Minv @ arm.J.T], [arm.J @ Minv, np.zeros((m, m))]])
        right = np.concatenate([Minv @ space.secondary_torque, np.zeros(m)])
        optimum = np.linalg.solve(kkt, right)[:n]
        scale = np.linalg.norm(space.secondary_torque)
        assert np.linalg.norm(space.null - optimum) < 1e-12 * max(scale, 1.0) * np.linalg.cond(arm.M)
        # and the hand stays: J M^-1 tau_N = 0
        assert np.abs(arm.J @ Minv @ space.null).max() < 1e-9


def test_the_qp_agrees_to_the_last_digits_on_the_device(arm: RedundantArm) -> None:
    rng = np.random.default_rng(8)
    space = NullSpace(arm, LIMIT, home_shape(arm), GAINS, U)
    worst = 0.0
    for _ in range(300):
        at_random(arm, rng)
        if narrow(arm):
            continue
        assert space.secondary(rng.uniform())
        Minv = np.linalg.inv(arm.M)
        null = np.linalg.svd(arm.J @ Minv)[2][2:].T  # tau = null y satisfies the constraint
        weighted = null.T @ Minv
        optimum = null @ np.linalg.solve(weighted @ null, weighted @ space.secondary_torque)
        size = np.linalg.norm(space.secondary_torque)
        worst = max(worst, np.linalg.norm(space.null - optimum) / size)
    assert worst < 1e-12


def test_the_c_core_computes_what_numpy_does(arm: RedundantArm) -> None:
    rng = np.random.default_rng(2)
    shape = home_shape(arm)
    space = NullSpace(arm, LIMIT, shape, GAINS, U)
    raised = 0
    for _ in range(300):
        at_random(arm, rng)
        raised += narrow(arm)
        omega, v, w = rng.uniform(), rng.standard_normal(2), rng.standard_normal(2)
        space.motion[:], space.contact[:] = direction(v), direction(w)
        assert space.secondary(omega)
        D = omega * shape.free(direction(v)) + (1.0 - omega) * shape.stiff(direction(w))  # (16)
        B = np.linalg.inv(D)
        gradient = stein_gradient(arm.J, arm.dJ, LIMIT, B)
        secondary = -GAINS.beta * gradient - GAINS.damping * arm.qd  # (6)
        N = raised_projection(arm)  # (3)
        projected, drive = N @ secondary, np.linalg.norm(N @ (GAINS.beta * gradient))
        assert space.cost == pytest.approx(float(stein(velocity_ellipsoid(arm.J, LIMIT), B)), rel=1e-9)
        np.testing.assert_allclose(space.gradient, gradient, atol=1e-9 * np.abs(gradient).max())
        np.testing.assert_allclose(space.secondary_torque, secondary, atol=1e-9 * np.abs(secondary).max())
        np.testing.assert_allclose(space.null, projected, atol=1e-9 * np.abs(secondary).max())
        assert space.drive == pytest.approx(drive, rel=1e-6, abs=1e-9)
    assert 0 < raised < 30


@pytest.mark.parametrize("levels", [False, True])
def test_through_a_singular_posture_torques_stay_small(arm: RedundantArm, levels: bool) -> None:
    """The whole chain nearly stretched: to cancel what the posture does to the hand would take any torque."""
    space = NullSpace(arm, LIMIT, home_shape(arm), Gains(20.0, 0.1, 0.5, 0.0, (0.05,) * 4), U)
    hierarchy = Hierarchy(space)
    torques = []
    for bend in np.linspace(-0.2, 0.2, 401):
        arm.q[:] = np.array([0.0, np.pi / 2, -np.pi / 2, 0.0]) + bend * np.array([1.0, 0.3, -0.8, 0.6])
        arm.qd[:] = -1.0, 2.0, 3.0, -1.0
        arm.update()
        if not space.secondary(1.0):
            continue
        space.want([0.0, 0.0])
        space.compose(1.0)
        assert not levels or hierarchy.resolve(1.0, 1.0)
        torques.append((hierarchy if levels else space).torque.copy())
        assert narrow(arm) or abs(bend) > 5e-3
    assert len(torques) > 390
    assert np.abs(torques).max() < 0.7 * LIMIT.max()


def test_dynamically_consistent_inverse_is_an_inverse(arm: RedundantArm) -> None:
    at_random(arm, np.random.default_rng(3))
    np.testing.assert_allclose(arm.J @ dynamic_inverse(arm.J, arm.M), np.eye(2), atol=1e-12)
    N = null_projection(arm.J, arm.M)
    np.testing.assert_allclose(N @ N, N, atol=1e-12)
    np.testing.assert_allclose(N @ arm.J.T, 0.0, atol=1e-12)


def test_following_the_torque_lowers_the_cost(arm: RedundantArm) -> None:
    space = NullSpace(arm, LIMIT, home_shape(arm), GAINS, U)
    arm.q[:] = 0.66, 0.65, 0.47, 0.1
    arm.qd[:] = 0.0
    costs = []
    for _ in range(200):
        arm.update()
        assert space.secondary(0.0)
        costs.append(space.cost)
        arm.q += 1e-4 * np.linalg.solve(arm.M, space.null) * 0.05
    assert (np.diff(costs) < 0.0).all()


def test_the_gradient_torque_is_capped_and_the_damping_is_not(arm: RedundantArm) -> None:
    space = NullSpace(arm, LIMIT, home_shape(arm), Gains(20.0, 0.1, 0.5), U)
    arm.q[:], arm.qd[:] = (0.66, 0.65, 0.47, 0.1), (3.0, -2.0, 1.0, 4.0)
    arm.update()
    assert space.secondary(0.0)
    pull = space.secondary_torque + 0.1 * arm.qd
    assert space.drive > 0.5
    assert np.linalg.norm(null_projection(arm.J, arm.M) @ pull) == pytest.approx(0.5)
    np.testing.assert_allclose(
        pull / np.linalg.norm(pull), -space.gradient / np.linalg.norm(space.gradient), atol=1e-12
    )


def test_a_gradient_holds_no_posture_further_from_its_target_than_the_cap_is_worth(arm: RedundantArm) -> None:
    """However steep v is there: a target that is further away always pulls nearer."""
    cap, stiffness, rng = 2.0, 10.0, np.random.default_rng(6)
    space = NullSpace(arm, LIMIT, home_shape(arm), Gains(20.0, 0.0, cap, stiffness), U)
    held = 0
    for _ in range(300):
        space.free[:] = rng.uniform(-1.0, 1.0, arm.n)
        if np.linalg.cond(arm.at(rng.uniform(-1.5, 1.5, arm.n)).J) > 20.0 or not space.secondary(1.0):
            continue
        N = null_projection(arm.J, arm.M)
        spring, steep = N @ (stiffness * (space.free - arm.q)), N @ (-20.0 * space.gradient)
        if np.linalg.norm(spring) > 1.01 * cap:
            assert space.null @ spring > 0.0
            held += (spring + steep) @ spring < 0.0
    assert held > 10  # the gradient alone would have led away from them


def test_composition_keeps_every_limit_the_direction_of_the_force_and_prefers_it(arm: RedundantArm) -> None:
    rng = np.random.default_rng(5)
    space = NullSpace(arm, LIMIT, home_shape(arm), GAINS, U)
    for _ in range(300):
        at_random(arm, rng)
        assert space.secondary(0.0)
        force, part = rng.standard_normal(2) * rng.uniform(0, 40), rng.uniform(0.5, 1.0)
        space.want(force)
        np.testing.assert_allclose(space.wanted, arm.J.T @ force, atol=1e-12)
        space.compose(part)
        assert (np.abs(space.torque) <= LIMIT).all()
        posture = space.null + arm.J.T @ space.coupling
        np.testing.assert_allclose(
            space.torque, space.alpha * space.wanted + space.share * posture, atol=1e-12
        )
        worst = np.max(np.abs(space.wanted) / LIMIT)
        assert space.alpha == pytest.approx(min(1.0, part / worst))
        if space.share < 1.0:  # no larger share would keep the limits
            assert np.max(np.abs(space.torque) / LIMIT) == pytest.approx(1.0)


def test_the_share_of_the_posture_rises_and_falls_at_a_bounded_rate_and_the_force_yields(
    arm: RedundantArm,
) -> None:
    """A motor that saturates would give the posture all or nothing from tick to tick."""
    space = NullSpace(arm, LIMIT, home_shape(arm), Gains(20.0, 0.1, 1.0), U, slew=0.02)
    arm.q[:], arm.qd[:] = (0.66, 0.65, 0.47, 0.1), 0.0
    arm.update()
    assert space.secondary(0.0)
    shares = []
    for k in range(300):
        space.want([0.0, -60.0 if k % 100 < 50 else 0.0])
        space.compose(1.0)
        shares.append(space.share)
        assert (np.abs(space.torque) <= LIMIT).all()
        np.testing.assert_allclose(
            space.torque, space.alpha * space.wanted + space.share * (space.null + arm.J.T @ space.coupling)
        )
    assert min(shares) < 0.2 and max(shares) == 1.0
    assert np.diff(shares).max() == pytest.approx(0.02) and np.diff(shares).min() == pytest.approx(-0.05)


def test_the_posture_s_torques_change_at_a_bounded_rate_and_leave_the_hand_alone(arm: RedundantArm) -> None:
    """A posture that arrives at speed is braked at once by its damping."""
    slew, rng = 0.03, np.random.default_rng(11)
    slow = NullSpace(arm, LIMIT, home_shape(arm), GAINS, U, slew=slew)
    free = NullSpace(arm, LIMIT, home_shape(arm), GAINS, U)
    bounded = 0
    for _ in range(40):
        at_random(arm, rng)
        hand = np.linalg.eigvalsh(arm.J @ np.linalg.solve(arm.M, arm.J.T))
        if hand[0] < 0.01 * hand.sum():  # next to a singular posture the hand feels a little of it
            continue
        slow.reset()
        for _ in range(200):
            before = slow.null.copy()
            assert slow.secondary(0.5) and free.secondary(0.5)
            step = np.max(np.abs(slow.null - before) / LIMIT)
            assert step <= 2.0 * slew + 1e-9
            np.testing.assert_allclose(dynamic_inverse(arm.J, arm.M).T @ slow.null, 0.0, atol=1e-9)
            bounded += not np.allclose(slow.null, free.null)
        np.testing.assert_allclose(slow.null, free.null, atol=1e-9)
    assert bounded > 100


def test_torques_step_no_further_than_is_theirs_and_the_force_s_change_explains(arm: RedundantArm) -> None:
    """Whatever is resolved from tick to tick; the hand feels the share that is told, at last all of it."""
    slew, rng = 0.02, np.random.default_rng(13)
    space = NullSpace(arm, LIMIT, home_shape(arm), GAINS, U, slew=slew)
    arm.q[:], arm.qd[:] = (0.66, 0.65, 0.47, 0.1), 0.0
    arm.update()
    assert space.secondary(0.0)
    N = null_projection(arm.J, arm.M)
    space.reset()
    before, force_before, eased = np.zeros(4), np.zeros(2), 0
    torque = np.zeros(4)
    for k in range(600):
        if k % 40 == 0:
            force, share = 8.0 * rng.standard_normal(2), rng.uniform()
            force *= min(1.0, 0.5 / np.max(np.abs(arm.J.T @ force) / LIMIT))
            posture = N @ rng.standard_normal(4)
            posture *= 0.5 / np.max(np.abs(posture) / LIMIT)
        resolved = share * arm.J.T @ force + posture
        torque[:] = resolved
        rendered = space.ease(torque, force.tolist(), share)
        most = 2.8 * slew * LIMIT + np.abs(arm.J.T @ (force - force_before))
        assert (np.abs(torque - before) <= most + 1e-12).all()
        np.testing.assert_allclose(space.inverse @ torque, rendered * force, atol=1e-9)
        if k % 40 == 39:
            np.testing.assert_array_equal(torque, resolved)
            assert rendered == share
        eased += not np.array_equal(torque, resolved)
        before, force_before = torque.copy(), force.copy()
    assert eased > 100


def test_what_motors_bear_leaves_the_coupling_force_its_torque(arm: RedundantArm) -> None:
    rng = np.random.default_rng(7)
    space = NullSpace(arm, LIMIT, home_shape(arm), GAINS, U)
    less = 0
    for _ in range(300):
        at_random(arm, rng)
        assert space.secondary(0.0)
        space.want(rng.standard_normal(2) * 40.0)
        coupling = arm.J.T @ space.coupling
        if (np.abs(coupling) > LIMIT).any():
            continue
        alpha = space.bearable(1.0)
        assert alpha <= space.within(1.0)
        used = np.abs(alpha * space.wanted + coupling) / LIMIT
        assert used.max() <= 1.0 + 1e-12
        if alpha < space.within(1.0):
            assert used.max() == pytest.approx(1.0)
            less += 1
    assert less > 10


def test_the_posture_fades_in_and_what_its_motion_does_to_the_hand_is_cancelled_as_a_whole(
    arm: RedundantArm,
) -> None:
    rng = np.random.default_rng(8)
    space = NullSpace(arm, 100.0 * LIMIT, home_shape(arm), Gains(20.0, 0.1, 0.3), U)
    force_b, others = np.zeros(2), [np.zeros((2, 5)), np.zeros((4, 5)), np.zeros((5, 5)), np.zeros(5)]
    rows = [others[0], force_b, *others[1:]]
    tried = 0
    for _ in range(100):
        at_random(arm, rng)
        assert space.secondary(0.0)
        space.want([0.0, 0.0])
        space.compose(1.0, 0.25)
        space.level_rows(rows, 0.25)
        np.testing.assert_allclose(force_b, space.coupling, atol=1e-9)
        if space.share < 1.0:
            continue
        np.testing.assert_allclose(space.inverse @ space.torque, space.coupling, atol=1e-9)
        np.testing.assert_allclose(space.torque - arm.J.T @ space.coupling, 0.25 * space.null, atol=1e-9)
        tried += bool(np.linalg.norm(space.coupling) > 0.05)
    assert tried > 10


def test_a_singular_posture_is_said_to_be_one(arm: RedundantArm) -> None:
    space = NullSpace(arm, LIMIT, home_shape(arm), GAINS, U)
    arm.at(np.array([0.0, np.pi / 2, -np.pi / 2, 0.0]))  # the whole chain stretched along x
    assert not space.secondary(1.0)
    arm.q[:] = np.nan
    arm.update()
    assert not space.secondary(1.0)
