"""The whole controller of the redundant interface, in closed loop with a plant of its own."""

import numpy as np
import pytest
from hapticd.control.hold import Hold, HoldGains
from hapticd.machines.rhi.contact_aware import ContactAware, Settings
from hapticd.machines.rhi.guard import Span
from hapticd.machines.rhi.hierarchy import Hierarchy
from hapticd.machines.rhi.nullspace import Gains, NullSpace
from hapticd.machines.rhi.transition import Thresholds

from .rhi_device import LIMIT, U, four_dof, home_shape, narrow, raised_projection, wall

DT = 1e-3
FRICTION = (0.063, 0.112, 0.040, 0.027)
FREE = np.array([1.15435, 0.04568, -0.0038, 1.52384])


def controller(follow: float = np.inf, gains: Gains | None = None) -> ContactAware:
    arm = four_dof()
    gains = gains or Gains(20.0, 0.1, 1.2, 0.0, FRICTION)
    settings = Settings(home_shape(arm), gains, Thresholds(0.7, 0.95), 1.0, 0.003, 0.85, 2.0, 0.1, follow)
    made = ContactAware(arm, LIMIT, U, settings, DT)
    arm.q[:] = FREE
    made.reset()
    return made


def acceleration_of_hand(made: ContactAware, torque: np.ndarray) -> np.ndarray:
    """J M^-1 (tau - bias - friction) + dJ/dt qd."""
    arm = made.arm
    load = torque - arm.bias - np.array(FRICTION) * arm.qd
    return arm.J @ np.linalg.solve(arm.M, load) + arm.drift


def test_null_space_torque_does_not_move_the_hand() -> None:
    made = controller()
    rng = np.random.default_rng(1)
    for _ in range(200):
        made.arm.q[:], made.arm.qd[:] = rng.uniform(-1.5, 1.5, 4), rng.standard_normal(4)
        made.arm.update()
        assert made.space.secondary(rng.uniform())
        moved = made.arm.J @ np.linalg.solve(made.arm.M, made.space.null)
        assert np.abs(moved).max() < 1e-9 * max(1.0, np.linalg.norm(made.space.null))


def test_the_coupling_force_cancels_what_the_motion_of_the_posture_does_to_the_hand() -> None:
    """With it, the hand keeps its speed while the posture moves: motion along the null space, no force."""
    made = controller()
    arm, rng = made.arm, np.random.default_rng(2)
    for _ in range(200):
        arm.q[:] = rng.uniform(-1.5, 1.5, 4)
        arm.qd[:] = 0.0
        arm.update()
        arm.qd[:] = np.linalg.svd(arm.J)[2][2:].T @ rng.standard_normal(2) * 3.0
        arm.update()
        if narrow(arm):
            continue
        assert made.space.secondary(0.5)
        torque = made.space.null + arm.J.T @ made.space.coupling
        assert np.abs(acceleration_of_hand(made, torque)).max() < 1e-8
        assert np.abs(acceleration_of_hand(made, made.space.null)).max() > 1e-3


def test_bias_and_drift_are_those_of_differences() -> None:
    """The work of the bias is the change of kinetic energy that M(q) makes; the drift is dJ/dt qd."""
    arm = four_dof()
    rng = np.random.default_rng(3)
    h = 1e-6
    for _ in range(50):
        q, qd = rng.uniform(-2, 2, 4), rng.standard_normal(4)
        arm.q[:], arm.qd[:] = q, qd
        arm.update()
        bias, drift = arm.bias.copy(), arm.drift.copy()
        M = [arm.at(q + s * h * qd).M.copy() for s in (1, -1)]
        assert qd @ bias == pytest.approx(0.5 * qd @ (M[0] - M[1]) @ qd / (2 * h), abs=1e-7)
        J = [arm.at(q + s * h * qd).J.copy() for s in (1, -1)]
        np.testing.assert_allclose(drift, (J[0] - J[1]) @ qd / (2 * h), atol=1e-7)


def test_an_unloaded_hand_stays_in_the_free_posture_and_a_loaded_one_gets_the_stiff_ellipsoid() -> None:
    made = controller()
    for _ in range(50):
        made.arm.update()
        assert made.update([0.0, 0.0], 1.0)
    assert made.transition.omega == 1.0 and made.reserve == 1.0
    for _ in range(600):
        assert made.update([0.0, -6.0], 1.0)
    assert made.transition.omega == 0.0
    assert (np.abs(made.torque) <= LIMIT).all()


def test_engaging_fades_force_and_posture_in() -> None:
    made = controller()
    made.arm.qd[:] = 0.0
    made.arm.q[:] = 0.66, 0.65, 0.47, 0.1
    made.arm.update()
    made.reset()
    made.update([0.0, -2.0], 0.0)
    np.testing.assert_array_equal(made.torque, 0.0)
    sizes = []
    for gain in (0.25, 0.5, 1.0):
        made.reset()
        made.update([0.0, -2.0], gain)
        sizes.append(np.linalg.norm(made.torque))
    assert sizes[0] < sizes[1] < sizes[2]


def test_the_direction_of_motion_follows_the_hand_whichever_way_it_goes() -> None:
    made = controller(follow=0.1)
    arm = made.arm
    along = np.linalg.pinv(arm.J) @ [1.0, 0.0]
    for k in range(600):
        arm.q[:], arm.qd[:] = FREE, (-1.0) ** (k // 50) * 0.2 * along  # to and fro along x
        arm.update()
        made.update([0.0, 0.0], 1.0)
    np.testing.assert_allclose(made.space.motion, [[1.0, 0.0], [0.0, 0.0]], atol=0.01)
    np.testing.assert_allclose(made.space.contact, [[0.0, 0.0], [0.0, 1.0]])
    before = made.space.motion.copy()
    arm.qd[:] = 1e-4
    arm.update()
    made.update([0.0, 0.0], 1.0)
    np.testing.assert_array_equal(made.space.motion, before)  # too slow to mean a direction


def test_far_from_the_limits_the_hierarchy_is_the_projection() -> None:
    arm = four_dof()
    space = NullSpace(arm, LIMIT, home_shape(arm), Gains(20.0, 0.1, 1.2, 0.0, FRICTION), U)
    hierarchy = Hierarchy(space)
    rng = np.random.default_rng(5)
    compared = 0
    for _ in range(300):
        arm.q[:], arm.qd[:] = rng.uniform(-1.5, 1.5, 4), 0.3 * rng.standard_normal(4)
        arm.update()
        assert space.secondary(rng.uniform())
        space.want(rng.standard_normal(2))
        space.compose(1.0)
        projected, share, alpha = space.torque.copy(), space.share, space.alpha
        assert hierarchy.resolve(1.0, 1.0)
        assert (np.abs(hierarchy.torque) <= LIMIT).all()
        # where the motors cannot give both, the posture costs the force next to nothing
        assert alpha - 0.01 <= hierarchy.alpha <= alpha + 1e-9
        if share == 1.0 and alpha == 1.0:
            assert hierarchy.alpha == pytest.approx(1.0, abs=1e-9)
            np.testing.assert_allclose(hierarchy.torque, projected, atol=1e-7)
            compared += 1
        if narrow(arm):
            continue
        # the hand feels what is rendered, and nothing else
        felt = space.inverse @ hierarchy.torque - space.coupling
        np.testing.assert_allclose(felt, hierarchy.alpha * (space.inverse @ space.wanted), atol=1e-6)
    assert compared > 50


def test_at_the_limits_the_hierarchy_gets_more_out_of_the_motors() -> None:
    """In the M^-1 metric its torques are never further from what the posture wants than the projection's."""
    arm = four_dof()
    space = NullSpace(arm, LIMIT, home_shape(arm), Gains(20.0, 0.1, 1.2, 0.0, FRICTION), U)
    hierarchy = Hierarchy(space)
    rng = np.random.default_rng(6)
    better = 0
    for _ in range(300):
        arm.q[:], arm.qd[:] = rng.uniform(-1.2, 1.2, 4), 0.0
        arm.update()
        assert space.secondary(0.0)
        space.want([0.0, -20.0])
        space.compose(0.85)
        assert hierarchy.resolve(0.85, 1.0)
        assert hierarchy.alpha == pytest.approx(space.alpha, abs=1e-9)
        far = [np.linalg.norm(space.root @ (tau - space.null)) for tau in (space.torque, hierarchy.torque)]
        assert far[1] <= far[0] + 1e-6
        better += far[1] < far[0] - 1e-3
    assert better > 30


def test_where_the_joint_limits_bind_both_resolutions_keep_them_and_the_hand_feels_the_same() -> None:
    span = Span((-1.0, -0.8, -1.8, -2.2), (2.0, 2.6, 1.8, 2.2), 0.15)
    arm = four_dof()
    space = NullSpace(arm, LIMIT, home_shape(arm), Gains(20.0, 0.1, 2.0, 0.0, FRICTION), U, span)
    hierarchy, rng, bound = Hierarchy(space), np.random.default_rng(8), 0
    lower, upper = np.array(span.lower), np.array(span.upper)
    for _ in range(400):
        share = np.clip(rng.uniform(-0.1, 1.1, 4), 0.05, 0.95)
        arm.q[:], arm.qd[:] = lower + share * (upper - lower), 0.3 * rng.standard_normal(4)
        arm.update()
        if np.linalg.cond(arm.J) > 10.0 or not space.secondary(1.0):
            continue
        space.want(rng.standard_normal(2))
        space.compose(1.0)
        guard = space.guard
        assert hierarchy.resolve(1.0, 1.0)
        if space.share < 1.0 or np.max(np.abs(space.torque) / LIMIT) > 0.999 or guard.stop.any():
            continue
        moved = guard.rows @ hierarchy.torque
        lack = np.maximum(guard.floor - moved, moved - guard.ceiling).max()
        free = np.maximum(
            guard.floor - guard.rows @ space.null, guard.rows @ space.null - guard.ceiling
        ).max()
        if lack < 1e-6 < free and np.linalg.norm(guard.hold(space.null)) < 1.0:
            bound += 1
            soft = guard.rows @ space.torque
            assert np.maximum(guard.floor - soft, soft - guard.ceiling).max() < 0.15 * free + 0.05
        for torque, alpha in ((space.torque, space.alpha), (hierarchy.torque, hierarchy.alpha)):
            felt = space.inverse @ torque - space.coupling
            np.testing.assert_allclose(felt, alpha * (space.inverse @ space.wanted), atol=1e-6)
    assert bound > 20


def test_the_hierarchy_s_torques_move_with_the_posture_where_two_limits_bind() -> None:
    """Limits that nothing may pass ask for all the torque there is, one way or the other, next to postures
    that hardly move their motors; so does a force that comes before the posture at corners of the box."""
    span = Span((-1.0, -0.8, -1.8, -2.2), (2.0, 2.6, 1.8, 2.2), 0.15)
    lower, upper = np.array(span.lower), np.array(span.upper)
    arm = four_dof()
    space = NullSpace(arm, LIMIT, home_shape(arm), Gains(20.0, 0.1, 2.0, 10.0, FRICTION), U, span)
    hierarchy, rng, paths = Hierarchy(space), np.random.default_rng(1), 0
    for k in range(300):
        begin = lower + rng.uniform(0.02, 0.98, 4) * (upper - lower)
        for i in rng.choice(4, 2, replace=False):
            room = rng.uniform(0.05, 0.12)
            begin[i] = upper[i] - room if rng.random() < 0.5 else lower[i] + room
        way = rng.standard_normal(4)
        way *= 0.02 / np.linalg.norm(way)
        arm.qd[:] = 0.3 * rng.standard_normal(4)
        space.free[:] = begin + rng.standard_normal(4)
        force = [0.0, 0.0] if k % 2 else (20.0 * rng.standard_normal(2)).tolist()
        torques = []
        for part in np.linspace(0.0, 1.0, 100):  # steps of 0.2 mrad
            arm.q[:] = begin + part * way
            arm.update()
            if not space.secondary(1.0):
                break
            space.want(force)
            assert hierarchy.resolve(1.0, 1.0)
            torques.append(hierarchy.torque / LIMIT)
        else:
            assert np.abs(np.diff(torques, axis=0)).max() < 0.1
            paths += 1
    assert paths > 250


def test_the_direction_of_contact_is_that_of_the_measured_force() -> None:
    """(13): not the wall's normal, and only where there is contact and a force that has a direction."""
    made = controller()
    arm = made.arm
    arm.update()
    along = np.array([0.6, 0.8])
    for k in range(500):
        assert made.update([0.0, -4.0], 1.0, 0.0, ((-1.0) ** (k // 50) * 5.0 * along).tolist())
    np.testing.assert_allclose(made.space.contact, np.outer(along, along), atol=3e-3)
    before = made.space.contact.copy()
    assert made.update([0.0, -4.0], 1.0, 0.0, [0.1, 0.0])  # too light
    assert made.update([0.0, 0.0], 1.0, 0.0, [5.0, 0.0])  # inertia, no contact
    assert made.update([0.0, -4.0], 1.0, 0.0, None)  # not measured
    np.testing.assert_array_equal(made.space.contact, before)
    made.reset()
    np.testing.assert_array_equal(made.space.contact, np.outer(U, U))


def test_the_duration_of_a_transition_is_the_printed_norm() -> None:
    """(19), for any two directions: rho |D_free - D_stiff|_F."""
    rng = np.random.default_rng(9)
    made = controller()
    shape = home_shape(four_dof())
    made.arm.update()
    for _ in range(20):
        w = rng.standard_normal(2)
        for _ in range(400):
            made.update([0.0, -4.0], 1.0, 0.0, (5.0 * w / np.linalg.norm(w)).tolist())
        apart = shape.free(made.space.motion) - shape.stiff(made.space.contact)
        assert made._duration == pytest.approx(0.003 * np.linalg.norm(apart), rel=1e-6)


def test_without_a_ratio_the_damping_is_the_papers_and_with_one_that_of_the_curvature() -> None:
    arm, rng = four_dof(), np.random.default_rng(10)
    gains = Gains(20.0, 0.1, np.inf, 10.0, ratio=0.25, fastest=100.0)
    space = NullSpace(arm, LIMIT, home_shape(arm), gains, U)
    for _ in range(100):
        arm.q[:], arm.qd[:] = rng.uniform(-1.5, 1.5, 4), rng.standard_normal(4)
        arm.update()
        assert space.secondary(0.3)
        W2 = np.diag(LIMIT**-2.0)
        X = [np.linalg.solve(arm.J @ W2 @ arm.J.T, d @ W2 @ arm.J.T + arm.J @ W2 @ d.T) for d in arm.dJ]
        H = np.array([[0.5 * np.trace(a @ b) for b in X] for a in X])
        mobile = np.linalg.solve(arm.M, raised_projection(arm))
        square = np.trace(mobile @ (20.0 * H + 10.0 * np.eye(4)))
        scale = min(1.0, 100.0**2 / square)
        pull = 20.0 * space.gradient + 10.0 * arm.q
        wanted = -scale * pull - 0.1 * arm.qd - 2.0 * 0.25 * np.sqrt(scale * square) * arm.M @ arm.qd
        np.testing.assert_allclose(space.secondary_torque, wanted, rtol=1e-9, atol=1e-9)


def test_a_wall_pushes_back_along_its_normal_and_only_behind_it() -> None:
    rendered = wall((0.5, 0.1), (0.0, 2.0), 1000.0)
    assert rendered.force([0.3, 0.09]) == [0.0, 0.0] and rendered.depth == 0.0
    np.testing.assert_allclose(rendered.force([0.3, 0.11]), [0.0, -10.0])
    assert rendered.depth == pytest.approx(0.01)


def test_a_hold_slows_down_as_rated_and_then_stands() -> None:
    gains = HoldGains(np.full(2, 20.0), np.full(2, 0.5), np.full(2, 100.0), np.array([1.0, 5.0]))
    hold = Hold(gains, DT)
    hold.reset(np.zeros(2), np.array([3.0, -1.0]))
    rates = []
    while not hold.at_rest:
        hold.update(hold.reference.copy(), hold.rate.copy())
        rates.append(hold.rate.copy())
    assert len(rates) == 30
    assert np.abs(np.diff(rates, axis=0)).max() <= 0.1 + 1e-12
    np.testing.assert_allclose(hold.reference, [3.0**2 / 200, -(1.0**2) / 200], rtol=1e-6)
    hold.reset(np.zeros(2), np.zeros(2))
    np.testing.assert_allclose(hold.update(np.array([1.0, 0.1]), np.zeros(2)), [-1.0, -2.0])
