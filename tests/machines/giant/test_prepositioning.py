"""The PPU's reference and its velocity bounds."""

from math import atan, cos, inf, isnan, nan, pi, sin, sqrt

import numpy as np
import pytest
from hapticd.control._kernels import ffi, lib
from hapticd.machines.giant.kinematics import DH, LOWER, T_BASE_DH, UPPER, Branch, inverse_kinematics
from hapticd.machines.giant.prepositioning import PpuLimits, Prepositioning
from hapticd.models import Array
from hapticd.models.dh import forward

LIMITS = PpuLimits((-1.6, -1.9), (1.6, 1.9), 1.2, 3.0, 0.05)
ANGLES = ((0.45, -2.2), (2.4, 1.2))
"""Lower and upper limits of joints 2 and 3."""
Corners = tuple[tuple[float, ...], tuple[float, ...]]
BOX: Corners = ((-2.2, -2.6, -1.28), (2.2, 2.6, -0.7))
ANYWHERE: Corners = ((-inf,) * 3, (inf,) * 3)
"""Where the elbow may be."""
DT = 1e-3
POSTURE = np.array([0.0, pi / 2, -0.6, 0.3, 0.9, 0.0])


class Rig(Prepositioning):
    """With a motion of its own, and the law of a single axis."""

    def __init__(self, gain: float = 3.0, limits: PpuLimits = LIMITS, elbow: Corners = ANYWHERE) -> None:
        self.q, self.q_ppu, self.qd_ppu = POSTURE.copy(), np.zeros(2), np.zeros(2)
        super().__init__(gain, limits, ANGLES, elbow, DT, self.q, self.q_ppu, self.qd_ppu)

    def command(self, axis: int, error: float, ahead: float) -> float:
        bounds = ffi.new("double[2]")
        wanted = lib.ppu_wanted(self._core, axis, error, ahead, bounds, bounds + 1)
        step, last = LIMITS.acceleration * DT, float(self.velocity[axis])
        return float(wanted if isnan(wanted) else min(max(wanted, last - step), last + step))


def test_at_the_reference_joints_2_and_3_take_their_best_angles_and_the_handle_stays() -> None:
    rng = np.random.default_rng(2)
    rig = Rig()
    for _ in range(200):
        rig.q[:] = rng.uniform([-3, 0.5, -2, 0.1, 0.3, -1], [3, 2.3, 1, 1.1, 1.0, 1])
        rig.q_ppu[:] = rng.uniform(-1.0, 1.0, 2)
        handle = forward(T_BASE_DH, DH, np.concatenate([rig.q_ppu, rig.q]))[-1]
        there = inverse_kinematics(handle, rig.reference(), Branch(raised=rig.q[3] > 0))
        assert there[1] == pytest.approx(pi / 2, abs=1e-9)
        assert (there[2] + atan(0.53 / 0.67) + pi) % (2 * pi) == pytest.approx(pi, abs=1e-9)


def law(rig: Rig, axis: int, error: float, ahead: float) -> float:
    """(27)-(29) with the braking curve and the slew limit, as one reads them."""
    low, high = LIMITS.lower[axis], LIMITS.upper[axis]
    below, above = max(ahead - low, 0.0), max(high - ahead, 0.0)
    a = 0.7 * LIMITS.acceleration
    slowest = -min(below / DT, sqrt(2.0 * a * below), LIMITS.velocity)
    fastest = min(above / DT, sqrt(2.0 * a * above), LIMITS.velocity)
    wanted = min(max(3.0 * error, slowest), fastest)
    step, last = LIMITS.acceleration * DT, float(rig.velocity[axis])
    return min(max(wanted, last - step), last + step)


def test_the_kernel_is_the_law() -> None:
    rng = np.random.default_rng(5)
    rig = Rig()
    for _ in range(2000):
        axis, error, ahead = int(rng.integers(2)), float(rng.normal()), float(rng.uniform(-2.1, 2.1))
        rig.velocity[:] = rng.uniform(-1.2, 1.2, 2)
        assert rig.command(axis, error, ahead) == law(rig, axis, error, ahead)


def test_what_is_not_a_number_reaches_the_gate_as_such_and_never_as_motion() -> None:
    rig = Rig()
    assert isnan(rig.command(0, nan, 0.0))
    assert rig.command(0, 1.0, nan) == 0.0
    for broken in (nan, inf):
        rig.q[2] = broken
        rig.update()
        assert not np.isfinite(rig.velocity).any()
        rig.reset()


def drive(target: float, seconds: float) -> tuple[float, float, float]:
    """Axis x with its inverter towards a target: position, peak speed, peak acceleration."""
    rig = Rig()
    x = v = peak = hardest = 0.0
    for _ in range(round(seconds / DT)):
        command = rig.command(0, target - x, x + LIMITS.time_constant * v)
        rig.velocity[0] = command
        a = max(-3.0, min(3.0, (command - v) / LIMITS.time_constant))
        v += a * DT
        x += v * DT
        peak, hardest = max(peak, abs(v)), max(hardest, abs(a))
    return x, peak, hardest


def test_a_far_reference_brings_the_axis_to_its_limit_without_overshoot() -> None:
    x, peak, hardest = drive(50.0, 6.0)
    assert LIMITS.upper[0] - 1e-3 < x <= LIMITS.upper[0] + 1e-6
    assert peak <= LIMITS.velocity + 1e-9
    assert hardest <= LIMITS.acceleration + 1e-9
    x, _, _ = drive(-50.0, 6.0)
    assert x == pytest.approx(LIMITS.lower[0], abs=1e-3)


def test_a_reference_inside_is_reached_exponentially() -> None:
    x, _, _ = drive(0.3, 4.0)
    assert x == pytest.approx(0.3, abs=1e-4)


def settled(rig: Rig, q_ppu: Array) -> Array:
    rig.q_ppu[:] = q_ppu
    for _ in range(1000):
        rig.update()
    return rig.velocity


def test_beyond_its_limit_the_axis_is_only_sent_back() -> None:
    velocity = settled(Rig(), np.array([1.65, -1.95]))
    assert velocity[0] <= 0.0 <= velocity[1]


def test_the_way_that_the_lag_will_still_add_counts_as_travelled() -> None:
    still, moving = Rig(), Rig()
    moving.qd_ppu[:] = 0.5
    still.q[:3] = moving.q[:3] = [0.0, 0.3, 2.0]
    near = np.array([LIMITS.upper[0] - 0.05, 0.0])
    still.q_ppu[:] = near
    assert still.reference()[0] > near[0] + 0.2  # both are drawn towards the limit
    slow, fast = settled(moving, near)[0], settled(still, near)[0]
    assert 0.0 < slow < 0.75 * fast


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_elbow_is_carried_towards_its_box_no_faster_than_the_gantry_can_stop(
    axis: int, sign: float
) -> None:
    """Elsewhere than in front of its own limits, the gantry is drawn towards that of the elbow."""
    yaw = (0.0 if axis == 0 else pi / 2) + (0.0 if sign > 0.0 else pi)
    for distance in (1.5, 0.4, 0.2, 0.05, 0.0, -0.02):
        rigs = Rig(gain=30.0, elbow=BOX), Rig(gain=30.0)
        for rig in rigs:
            rig.q[:3] = yaw - 0.3, 0.6, 0.9
            arm = 2.0 * 0.6 * cos(0.3)  # rounded: both links are about 0.6 m long
            own = LIMITS.velocity * LIMITS.time_constant
            rig.qd_ppu[axis] = sign * LIMITS.velocity
            place = [0.0, 0.0]
            place[axis] = sign * (BOX[1][axis] - distance - arm - own)
            settled(rig, np.array(place))
        elbow = rigs[0].q_ppu[axis] + sum(
            length * (cos, sin)[axis](angle)
            for length, angle in zip((UPPER, LOWER), (yaw - 0.3, yaw + 0.3), strict=True)
        )
        left = max(BOX[1][axis] - sign * elbow - own, 0.0)
        speed, free = (sign * rig.velocity[axis] for rig in rigs)
        allowed = max(sqrt(2.0 * 0.7 * LIMITS.acceleration * left), 0.3)
        assert speed == pytest.approx(min(free, allowed), rel=1e-9)
        assert free > 0.9 and (distance <= 0.2) == (speed < free)


def test_the_braking_curve_uses_a_share_of_the_acceleration() -> None:
    rig = Rig(100.0)
    rig.velocity[0] = 1.2
    gap = 0.05
    assert rig.command(0, 10.0, LIMITS.upper[0] - gap) == pytest.approx(
        max(sqrt(2 * 0.7 * 3.0 * gap), 1.2 - 3.0 * DT)
    )


def test_stopping_brakes_at_the_rated_acceleration_to_exact_standstill() -> None:
    rig = Rig()
    rig.velocity[:] = [0.5, -0.2]
    rig.stop()
    assert rig.velocity == pytest.approx([0.497, -0.197])
    for _ in range(200):
        rig.stop()
    assert not rig.velocity.any()


def lead(rig: Rig, seconds: float) -> Array:
    """The gantry with its inverters, the handle held where it is: joints 1 to 3 at each tick, (ticks, 3)."""
    handle = forward(T_BASE_DH, DH, np.concatenate([rig.q_ppu, rig.q]))[-1]
    ways = []
    for _ in range(round(seconds / DT)):
        rig.update()
        rig.qd_ppu += np.clip((rig.velocity - rig.qd_ppu) / LIMITS.time_constant, -3.0, 3.0) * DT
        rig.q_ppu += rig.qd_ppu * DT
        there = inverse_kinematics(handle, rig.q_ppu, Branch(raised=rig.q[3] > 0))
        rig.q += (there - rig.q + pi) % (2.0 * pi) - pi
        ways.append(rig.q[:3].copy())
    return np.array(ways)


@pytest.mark.parametrize("seed", range(25))
def test_a_held_handle_is_never_torn_away_because_a_joint_has_come_to_its_limit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = Rig()
    rig.q[:] = rng.uniform([-3, 0.46, -2.1, 0.1, 0.3, -1], [3, 2.39, 1.19, 1.1, 1.0, 1])
    rig.q_ppu[:] = rng.uniform(LIMITS.lower, LIMITS.upper)
    before = np.linalg.norm(rig.reference() - rig.q_ppu)
    turned = lead(rig, 3.0)[:, 1:]
    assert (turned > np.array(ANGLES[0]) - 2e-3).all() and (turned < np.array(ANGLES[1]) + 2e-3).all()
    assert np.linalg.norm(rig.reference() - rig.q_ppu) <= before + 1e-3


def test_where_the_straight_way_leads_through_a_limit_the_gantry_goes_round() -> None:
    rig = Rig()
    rig.q[:] = [2.93, 2.39, 0.81, 0.436, 0.384, 0.927]
    way = rig.reference() - rig.q_ppu
    ahead = rig.q_ppu + 0.05 * way
    handle = forward(T_BASE_DH, DH, np.concatenate([rig.q_ppu, rig.q]))[-1]
    assert inverse_kinematics(handle, ahead, Branch(raised=True))[1] > ANGLES[1][0]  # as (27) would go
    turned = lead(rig, 6.0)
    assert turned[:, 1].max() < ANGLES[1][0] + 1e-3
    assert turned[-1, 1] == pytest.approx(pi / 2, abs=0.05)
