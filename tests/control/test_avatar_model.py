"""The avatar foreseen against an avatar that is simulated: law, plant, friction and transport."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.avatar_model import BEYOND, AvatarModel
from hapticd.control.limit_avoidance import POSITION
from hapticd.control.task_arm import Posture
from hapticd.experiments.following_arm import DT, foretell, lead
from hapticd.experiments.moved_arm import HOME, panda
from hapticd.models import Array

ROBOT = panda()
AT_LIMIT = np.array([2.7, *HOME[1:]])
"""An elbow whose home is next to the limit of joint 1, or it would turn away from it."""


@pytest.mark.parametrize("speed", [0.3, 0.6])
def test_the_limit_is_felt_earlier_by_the_lag_of_loop_and_transport(speed: float) -> None:
    start = AT_LIMIT.copy()
    start[0] = 2.8973 - np.radians(10) - speed * 1.2
    seen = foretell(lambda t: start + np.array([speed * t, 0, 0, 0, 0, 0, 0]), AT_LIMIT, 1.9, 10)
    found = [lead(-seen.ahead[:, 0], -seen.behind[:, 0], level) for level in (0.05, 0.1, 0.15)]
    assert seen.reached.all()
    np.testing.assert_allclose(found, seen.lag, rtol=0.15)


def test_prediction_and_measurement_tell_the_same_over_a_sweep() -> None:
    def joints(t: float) -> Array:
        q = AT_LIMIT.copy()
        q[0] = 2.95 - 0.2 * (1.0 + np.cos(2 * np.pi * t / 6.0))
        q[1] += 0.15 * np.sin(2 * np.pi * t / 4.0)
        q[3] += 0.2 * np.sin(2 * np.pi * t / 5.0)
        return q

    seen = foretell(joints, AT_LIMIT, 12.0, 10, friction=0.3)
    shift = round(seen.lag / DT)
    a, b = seen.ahead[500:-shift, 0], seen.behind[500 + shift :, 0]
    assert np.ptp(b) > 0.05
    assert np.corrcoef(a, b)[0, 1] >= 0.99


def pose(q: Array) -> tuple[Array, Array]:
    pin.framesForwardKinematics(ROBOT.model, ROBOT.data, q)
    at = ROBOT.data.oMf[ROBOT.frame("handle")]
    return at.translation, at.rotation


def made(lag: float = 0.2) -> AvatarModel:
    model = AvatarModel(ROBOT, "handle", Posture(HOME), lag, DT)
    model.measured[:] = HOME
    model.position[:], model.rotation[:] = pose(HOME)
    return model


def test_at_rest_at_home_nothing_is_foreseen_to_move() -> None:
    model = made()
    for _ in range(10):
        model.update()
    np.testing.assert_allclose(model.q, HOME, atol=1e-6)
    assert np.abs(model.qd).max() < 1e-6 and not model.wrench.any()


def test_the_first_prediction_has_no_velocity_however_far_it_is() -> None:
    model, there = made(), HOME + 0.3
    model.position[:], model.rotation[:] = pose(there)
    model.update()
    assert not model.qd.any()
    p, R = pose(model.q)
    np.testing.assert_allclose(p, model.position, atol=1e-9)
    np.testing.assert_allclose(R, model.rotation, atol=1e-9)


def test_it_settles_where_the_elbow_is_pulled_to() -> None:
    """A long lag: the least distance to the posture along the self-motion, found here by trying all q7."""
    model, rng = made(lag=1e6), np.random.default_rng(1)
    for _ in range(15):
        q = HOME + rng.uniform(-0.4, 0.4, 7)
        model.reset()
        model.measured[:] = q
        model.position[:], model.rotation[:] = pose(q)
        model.update()
        ik = model._ik
        p, R = pose(q)
        grid = np.linspace(HOME[6] - 0.8, HOME[6] + 0.8, 321)
        costs = [np.sum((b - HOME) ** 2) for q7 in grid for b in ik.branches(p, np.ascontiguousarray(R), q7)]
        assert np.sum((model.q - HOME) ** 2) <= min(costs) + 1e-4


def test_out_of_reach_it_holds_the_last_and_goes_on_pushing() -> None:
    model = made()
    outward = HOME.copy()
    outward[5] = ROBOT.upper[5] - 0.05
    model.measured[:] = outward
    model.position[:], model.rotation[:] = pose(outward)
    for _ in range(5):
        model.update()
    before = model.q.copy()
    assert model.reached and model.limits.torque.any() and model.wrench.any()
    model.position[0] += 1.5
    for _ in range(300):
        model.update()
    assert not model.reached and (model.q == before).all() and np.abs(model.qd).max() < 1e-6
    assert model.limits.torque.any() and np.isfinite(model.wrench).all()


def test_the_wrench_at_the_palm_gives_the_torques_back_away_from_singularities() -> None:
    model = made()
    q = HOME.copy()
    q[5] = ROBOT.upper[5] - 0.08
    model.measured[:] = q
    model.position[:], model.rotation[:] = pose(q)
    model.update()
    J = pin.computeFrameJacobian(ROBOT.model, ROBOT.data, model.q, ROBOT.frame("handle"), pin.LOCAL)
    damped = np.linalg.solve(J @ J.T + 0.05**2 * np.eye(6), J @ model.limits.torque)
    np.testing.assert_allclose(model.wrench, damped, atol=1e-9)


def test_next_to_a_singularity_the_wrench_stays_bounded() -> None:
    model, largest = made(), 0.0
    for elbow in np.linspace(-0.55, -0.4, 61):
        q = HOME.copy()
        q[3], q[5] = elbow, ROBOT.upper[5] - 0.02
        model.measured[:] = q
        model.position[:], model.rotation[:] = pose(q)
        model.update()
        largest = max(largest, float(np.abs(model.wrench).max()))
    most = 3.0 * POSITION.most
    assert 0.0 < largest <= most / (2 * 0.05) + 1e-9


def test_joints_past_their_limits_are_foreseen_so_that_the_push_does_not_jump() -> None:
    model, torques = made(), []
    for angle in np.linspace(-0.2, BEYOND - 0.02, 150):
        q = HOME.copy()
        q[6] = ROBOT.upper[6] + angle
        model.measured[:] = q
        model.position[:], model.rotation[:] = pose(q)
        model.update()
        torques.append(float(model.limits.torque[6]))
    assert np.abs(np.diff(torques)).max() < 3.0
