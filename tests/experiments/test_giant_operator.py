"""What a limit of a joint does to a palm, and the pulls into it."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.experiments.giant_operator import FADED_S, OUT_S, PULLS, Chain, Pulling, angle
from hapticd.runtime.configuration import config


def test_a_consistent_wrench_moves_the_palm_as_the_torque_of_its_joint_does() -> None:
    """Against forward dynamics by articulated bodies, with the rotors as armature."""
    chain = Chain(config.load("giant_operator"))
    model, q = chain.robot.model, np.array([-0.3, 0.4, 0.1, -2.2, 2.3, 1.3, -0.8])
    wrenches, mobility = chain.consistent(q)
    model.armature[:] = chain._rotors
    model.gravity = pin.Motion.Zero()
    data, still = model.createData(), np.zeros(7)
    J = pin.computeFrameJacobian(model, data, q, chain._end, pin.LOCAL_WORLD_ALIGNED)
    for j in range(7):
        by_joint = J @ pin.aba(model, data, q, still, np.eye(7)[j])
        by_wrench = J @ pin.aba(model, data, q, still, J.T @ wrenches[:, j])
        np.testing.assert_allclose(by_wrench, by_joint, atol=1e-9)
        np.testing.assert_allclose(mobility @ wrenches[:, j], by_joint, atol=1e-9)


def test_angles_between_wrenches_are_those_of_what_they_do() -> None:
    mobility = np.diag([4.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    x, y = np.eye(6)[:2]
    assert angle(x, 3.0 * x, mobility) == pytest.approx(0.0)
    assert angle(x, -y, mobility) == pytest.approx(np.pi / 2.0)
    assert angle(x + y, x, mobility) == pytest.approx(np.arctan2(1.0, 2.0))


def test_pulls_go_out_and_come_back_and_their_rates_are_those_of_their_places() -> None:
    hand = Pulling([1.0, 2.0, 3.0, 0.0, 1.0, 0.0])
    (_, turn), (way, _) = PULLS.values()
    assert hand.at(FADED_S - 1.0)[0] == [1.0, 2.0, 3.0, 0.0, 1.0, 0.0]
    assert hand.at(FADED_S + OUT_S + 0.5)[0][4] == pytest.approx(1.0 + turn)
    assert hand.at(FADED_S + 5.5 + OUT_S + 0.5)[0][0] == pytest.approx(1.0 + way[0])
    for t in np.arange(FADED_S, FADED_S + 10.5, 0.21):
        ahead, behind = (np.array(hand.at(t + h)[0]) for h in (1e-5, -1e-5))
        np.testing.assert_allclose((ahead - behind) / 2e-5, hand.at(t)[1], atol=1e-6)
