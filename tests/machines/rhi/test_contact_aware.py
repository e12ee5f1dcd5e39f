"""The whole controller of the redundant interface, in closed loop with a plant of its own."""

import numpy as np
import pytest
from hapticd.control.hold import Hold, HoldGains
from hapticd.machines.rhi.contact_aware import ContactAware, Settings
from hapticd.machines.rhi.environment import Wall
from hapticd.machines.rhi.hierarchy import Hierarchy
from hapticd.machines.rhi.nullspace import Gains
from hapticd.machines.rhi.transition import Thresholds

from .rhi_device import LIMIT, U, four_dof, home_shape

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
    made = controller()
    arm, space = made.arm, made.space
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
        assert hierarchy.alpha == pytest.approx(alpha, abs=1e-9)
        if share == 1.0 and alpha == 1.0:
            np.testing.assert_allclose(hierarchy.torque, projected, atol=1e-7)
            compared += 1
        # the hand feels the same either way
        felt = space.inverse @ hierarchy.torque - space.coupling
        np.testing.assert_allclose(felt, alpha * (space.inverse @ space.wanted), atol=1e-6)
    assert compared > 50


def test_at_the_limits_the_hierarchy_gets_more_out_of_the_motors() -> None:
    """Descent along the projected pull is never further from its wish than with the scaled projection."""
    made = controller()
    arm, space = made.arm, made.space
    hierarchy = Hierarchy(space)
    rng = np.random.default_rng(6)
    better = 0
    for _ in range(300):
        arm.q[:], arm.qd[:] = rng.uniform(-1.2, 1.2, 4), 0.0
        arm.update()
        assert space.secondary(0.0)
        space.want([0.0, -20.0])
        assert hierarchy.resolve(0.85, 1.0)
        wish = space.descent @ space.secondary_torque
        scaled, solved = (abs(space.descent @ tau - wish) for tau in (space.torque, hierarchy.torque))
        assert solved <= scaled + 1e-6
        better += solved < scaled - 1e-3
    assert better > 30


def test_a_wall_pushes_back_along_its_normal_and_only_behind_it() -> None:
    wall = Wall((0.5, 0.1), (0.0, 2.0), 1000.0)
    assert wall.normal == [0.0, 1.0]
    assert wall.force([0.3, 0.09]) == [0.0, 0.0] and wall.depth == 0.0
    np.testing.assert_allclose(wall.force([0.3, 0.11]), [0.0, -10.0])
    assert wall.depth == pytest.approx(0.01)


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
