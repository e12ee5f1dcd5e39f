"""Reserve of the motors, scaled forces, the force polytope, headroom."""

import numpy as np
import pytest
from hapticd.machines.rhi.saturation import Headroom, force_limit, force_share, reserve
from hapticd.machines.rhi.self_motion import descend

from .rhi_device import LIMIT, X0, U, four_dof, three_dof
from .test_manipulability import THREE_LIMIT, THREE_START
from .test_self_motion import objectives

FIG_6 = np.array([0.5, 2.0])  # ContactAware, fig. 6 [N m]


@pytest.mark.parametrize("S", [0.2, 1.0, 5.0])
def test_reserve_is_the_printed_observer(S: float) -> None:
    rng = np.random.default_rng(1)
    for tau in rng.uniform(-1, 1, (100, 2)) * FIG_6:
        # (14) term by term, with tau_min = -tau_max
        p = np.prod((tau - FIG_6) * (tau + FIG_6) / ((FIG_6 + FIG_6) / 2) ** 2) * (-1) ** 2
        assert reserve(tau, FIG_6, S) == pytest.approx((1 - np.exp(-S * p)) / (1 - np.exp(-S)))


def test_reserve_is_full_at_rest_and_empty_where_any_motor_saturates() -> None:
    assert reserve(np.zeros(4), LIMIT, 1.0) == 1.0
    for i in range(4):
        tau = np.zeros(4)
        tau[i] = -LIMIT[i]
        assert reserve(tau, LIMIT, 1.0) == 0.0
    assert reserve(2.0 * LIMIT, LIMIT, 1.0) == 0.0  # unclamped, an even number of them would look like room


def test_reserve_falls_with_every_torque() -> None:
    V = reserve(np.linspace(0, 1, 50)[:, None] * LIMIT, LIMIT, 1.0)
    assert (np.diff(V) < 0.0).all()


def test_a_saturated_force_keeps_its_direction() -> None:
    tau = np.array([[4.0, -1.0, 0.5, 0.2], [1.0, 1.0, 0.5, 0.5]])
    np.testing.assert_allclose(force_share(tau, LIMIT), [0.75, 1.0])


def test_force_before_saturation_in_three_postures_of_the_example() -> None:
    """ContactAware, fig. 3: 3.5 N is rendered unsaturated only in the stiff posture."""
    arm = three_dof()
    x = arm.at(THREE_START).position.copy()
    along_x = np.array([1.0, 0.0])
    forces = [float(force_limit(arm.J, THREE_LIMIT, along_x))]
    for objective in objectives(arm, THREE_START, THREE_LIMIT, along_x):
        q, _ = descend(arm, THREE_START[None], x, objective)
        forces.append(float(force_limit(arm.at(q[0]).J, THREE_LIMIT, along_x)))
    np.testing.assert_allclose(forces, [2.83, 2.15, 6.61], rtol=1e-2)


def test_the_polytope_is_exact() -> None:
    arm = four_dof().at(np.array([0.66, 0.65, 0.47, 0.1]))
    f = float(force_limit(arm.J, LIMIT, U))
    assert np.max(np.abs(arm.J.T @ U * f) / LIMIT) == pytest.approx(1.0)
    assert X0 @ [1.0, 0.0] * f <= LIMIT[:2].sum()  # the moment about the base that two motors carry


def test_headroom_is_held_while_the_posture_moves_and_let_go_slowly() -> None:
    headroom = Headroom(held=0.85, moving=0.1, release=0.1, dt=1e-3)
    parts = [headroom.update(1.0) for _ in range(150)]
    assert min(parts) == parts[-1] == 0.85
    parts += [headroom.update(0.05) for _ in range(99)]
    assert parts[-1] < 1.0
    assert headroom.update(0.05) == pytest.approx(1.0) and headroom.update(0.05) == 1.0
    assert np.abs(np.diff(parts)).max() < 0.0016
    headroom.update(1.0)
    headroom.reset()
    assert headroom.part == 1.0


def test_headroom_is_held_from_the_first_tick_in_which_the_posture_is_to_turn() -> None:
    """Its targets glide, so that there is hardly a pull at first, and a saturated force lets none begin."""
    headroom = Headroom(held=0.85, moving=0.1, release=0.1, dt=1e-3)
    parts = [headroom.update(0.0, turning=True) for _ in range(100)]
    assert parts[0] < 1.0 and parts[-1] == pytest.approx(0.85)
    assert [headroom.update(0.0) for _ in range(101)][-1] == 1.0


def test_headroom_has_a_play_and_no_threshold() -> None:
    """A pull that swings between once and half of what counts as moving never takes back what was let go."""
    headroom = Headroom(held=0.85, moving=0.1, release=1e-3, dt=1e-3)
    let_go = [headroom.update(drive) for drive in np.linspace(0.4, 0.0, 400)]
    assert np.diff(let_go).min() >= 0.0 and np.diff(let_go).max() < 0.01
    assert {headroom.update(drive) for drive in 0.1 + 0.05 * np.sin(np.arange(200))} == {1.0}
    taken = [headroom.update(drive) for drive in np.linspace(0.0, 0.4, 400)]
    assert np.diff(taken).max() <= 0.0 and np.diff(taken).min() > -0.01 and taken[-1] == pytest.approx(0.85)
    # on the way, between the two, it stays where it is
    headroom.reset()
    half = headroom.update(0.225)
    assert 0.85 < half < 1.0 and headroom.update(0.15) == half and headroom.update(0.1) == half
