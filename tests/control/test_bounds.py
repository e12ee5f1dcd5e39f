"""Acceleration intervals of section VI-B: closed forms, integration, and every edge."""

import numpy as np
import pytest
from hapticd.control._kernels import ffi, lib

DT = 1e-3
LIMITS = (-0.6, 1.15, 3.0, 40.0)


def limits(lower: float, upper: float, velocity: float, acceleration: float):  # type: ignore[no-untyped-def]
    return ffi.new(
        "bounds_limits *",
        {"lower": lower, "upper": upper, "velocity": velocity, "acceleration": acceleration},
    )


def a(q: float, qd: float, of: tuple[float, float, float, float] = LIMITS) -> tuple[float, float]:
    interval = lib.bounds_a(limits(*of), q, qd, DT)
    return interval.lower, interval.upper


def b(q: float, qd: float, of: tuple[float, float, float, float] = LIMITS) -> tuple[float, float]:
    interval = lib.bounds_b(limits(*of), q, qd, DT)
    return interval.lower, interval.upper


def least_by_bisection(gap: float, v: float) -> float:
    """Smallest constant acceleration with gap + v t + a t^2 / 2 >= 0 on all of [0, dt]."""
    t = np.linspace(0.0, DT, 4001)[1:]
    low, high = -1e8, 1e8
    for _ in range(120):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if np.all(gap + v * t + 0.5 * middle * t * t >= 0.0) else (middle, high)
    return high


def test_far_from_its_limits_a_joint_is_bound_by_its_speed_alone() -> None:
    assert a(0.2, 1.0) == pytest.approx((-4000.0, 2000.0))
    assert b(0.2, 1.0) == pytest.approx((-40.0, 40.0))


@pytest.mark.parametrize(
    ("gap", "v"), [(1e-4, -0.05), (1e-3, -0.9), (5e-4, -0.6), (2e-4, 0.3), (1e-5, -0.015)]
)
def test_set_a_is_the_least_acceleration_that_never_passes_the_limit(gap: float, v: float) -> None:
    expected = least_by_bisection(gap, v)
    assert a(LIMITS[0] + gap, v)[0] == pytest.approx(expected, rel=1e-3, abs=2.0)
    assert a(LIMITS[1] - gap, -v)[1] == pytest.approx(-expected, rel=1e-3, abs=2.0)


def test_exactly_on_the_limit_and_moving_outward_a_joint_makes_a_full_stop() -> None:
    assert a(LIMITS[0], -0.5)[0] == pytest.approx(500.0)
    assert a(LIMITS[1], 0.5)[1] == pytest.approx(-500.0)


def test_close_to_the_limit_a_joint_is_not_thrown_back_faster_than_it_came() -> None:
    for gap in (1e-12, 1e-9, 1e-6):
        assert a(LIMITS[0] + gap, -0.5)[0] <= 1000.0 * (1 + 1e-9)


def test_beyond_the_limit_a_joint_may_not_go_further() -> None:
    assert a(LIMITS[1] + 0.01, 0.0)[1] == pytest.approx(0.0, abs=1e-9)
    assert a(LIMITS[1] + 0.01, 0.2)[1] == pytest.approx(-200.0)


def test_a_joint_without_position_limits_has_finite_bounds() -> None:
    free = (-np.inf, np.inf, 2.5, 25.0)
    assert a(1e6, 2.0, free) == pytest.approx((-4500.0, 500.0))
    assert b(-1e6, 2.5, free) == pytest.approx((-25.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("push", ["lower", "upper", "random"])
def test_set_b_keeps_position_speed_and_acceleration_for_ever(push: str) -> None:
    rng = np.random.default_rng(5)
    lower, upper, velocity, acceleration = LIMITS
    q, qd = 0.3, 0.0
    for k in range(5000):
        low, high = b(q, qd)
        assert -acceleration - 1e-9 <= low <= high <= acceleration + 1e-9
        if push == "random":
            qdd = low + (high - low) * rng.choice([0.0, 1.0, rng.random()])
        else:
            qdd = high if (push == "upper") == (k % 2500 < 1500) else low
        t = DT / 2  # between the samples as well
        assert lower - 1e-9 <= q + qd * t + 0.5 * qdd * t * t <= upper + 1e-9
        q, qd = q + qd * DT + 0.5 * qdd * DT**2, qd + qdd * DT
        assert lower - 1e-9 <= q <= upper + 1e-9
        assert abs(qd) <= velocity + 1e-9


def test_set_b_brakes_a_state_that_is_no_longer_viable_as_hard_as_it_may() -> None:
    low, high = b(LIMITS[1] - 0.01, 2.9)
    assert high == pytest.approx(-LIMITS[3], rel=2e-2)
    assert low <= high


def within(q: float, qd: float, down: float, up: float) -> tuple[float, float]:
    interval = lib.bounds_b_within(limits(*LIMITS), down, up, q, qd, 5 * DT)
    return interval.lower, interval.upper


@pytest.mark.parametrize(("down", "up"), [(40.0, 40.0), (6.0, 20.0), (20.0, 3.0)])
def test_where_brakes_reach_less_a_joint_counts_on_no_more_but_starts_as_it_is_rated(
    down: float, up: float
) -> None:
    lower, upper, velocity, acceleration = LIMITS
    q, qd, hardest, fastest = 0.3, 0.0, np.zeros(2), 0.0
    for k in range(6000):
        low, high = within(q, qd, down, up)
        assert -acceleration - 1e-9 <= low <= high <= acceleration + 1e-9
        rising = k % 3000 < 1500
        qdd = high if rising else low
        hardest = np.maximum(hardest, [-qdd if qd > 0.0 and rising else 0.0, 0.0 if rising else qdd])
        fastest = max(fastest, abs(qdd) if qd == 0.0 else 0.0)
        q, qd = q + qd * DT + 0.5 * qdd * DT**2, qd + qdd * DT
        assert lower - 1e-6 <= q <= upper + 1e-6
        assert abs(qd) <= velocity + 1e-9
    np.testing.assert_allclose(hardest, [down, up], rtol=0.02)
    assert fastest == acceleration


def test_what_is_too_fast_for_its_brakes_brakes_as_hard_as_is_needed_and_rated() -> None:
    gap, v = 0.05, 1.5
    needed = v * v / (2.0 * gap)
    assert 10.0 < needed < LIMITS[3]
    assert within(LIMITS[1] - gap, v, 10.0, 10.0)[1] == pytest.approx(-needed)
    assert within(LIMITS[0] + gap, -v, 10.0, 10.0)[0] == pytest.approx(needed)
    assert within(LIMITS[1] - gap, 2.9, 10.0, 10.0)[1] == pytest.approx(-LIMITS[3])


def test_crossed_ends_close_to_a_point() -> None:
    rng = np.random.default_rng(6)
    for _ in range(20_000):
        q = rng.uniform(LIMITS[0] - 0.05, LIMITS[1] + 0.05)
        for low, high in (a(q, rng.uniform(-6, 6)), b(q, rng.uniform(-6, 6))):
            assert low <= high
            assert np.isfinite([low, high]).all()


def test_set_c_reaches_the_limit_after_one_horizon_from_inside_and_outside() -> None:
    for q, qd in ((0.9, 0.1), (1.1, 2.0), (1.4, -0.3)):
        interval = lib.bounds_c(-1.0, 1.0, q, qd, 0.015)
        for qdd, target in ((interval.lower, -1.0), (interval.upper, 1.0)):
            assert q + qd * 0.015 + 0.5 * qdd * 0.015**2 == pytest.approx(target)


def test_set_c_with_a_horizon_of_15_ms_arrives_without_bouncing() -> None:
    q, qd, peak = 0.9, 1.0, 0.0
    for _ in range(3000):  # pushed towards the limit all the time
        qdd = min(5.0, lib.bounds_c(-1.0, 1.0, q, qd, 0.015).upper)
        q, qd = q + qd * DT + 0.5 * qdd * DT**2, qd + qdd * DT
        peak = max(peak, abs(qdd))
        assert q <= 1.0 + 4e-3  # the overshoot that notes on (8) allow, 4 mrad
        assert qd >= -0.2
    assert abs(q - 1.0) < 5e-3
    assert peak < 110.0


PACE = (0.02, 0.05, 0.05)  # looks ahead, settles [s]; returns [rad/s]


JOINT, AT_PACE = limits(*LIMITS), ffi.new("bounds_pace *", PACE)


def able(q: float, qd: float, down: float, up: float) -> tuple[float, float]:
    interval = lib.bounds_able(JOINT, AT_PACE, down, up, q, qd)
    return interval.lower, interval.upper


@pytest.mark.parametrize(("down", "up"), [(40.0, 40.0), (6.0, 20.0), (20.0, 6.0), (4.0, 4.0)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_whoever_stays_within_reach_meets_limits_with_no_more_than_that_and_gently(
    down: float, up: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    lower, upper, velocity, acceleration = LIMITS
    q, qd, last, push = 0.3, 0.0, 0.0, 0.0
    for k in range(6000):
        low, high = able(q, qd, down, up)
        assert -acceleration - 1e-9 <= low <= high <= acceleration + 1e-9
        if k % 400 == 0:
            push = rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 60.0)
        wanted = np.clip(push, last - 4000.0 * DT, last + 4000.0 * DT)  # a hand has a jerk
        qdd = float(np.clip(wanted, low, high))
        if qdd != wanted:  # the limits, not the hand
            assert -down - 0.3 <= qdd <= up + 0.3 or abs(qdd) <= abs(wanted)
            assert abs(qdd - last) <= 6.0
        q, qd, last = q + qd * DT + 0.5 * qdd * DT**2, qd + qdd * DT, qdd
        assert lower - 1e-4 <= q <= upper + 1e-4
        assert abs(qd) <= velocity + 1e-9


def test_from_outside_it_returns_no_faster_than_it_may() -> None:
    q, qd, fastest = LIMITS[1] + 0.08, 0.0, 0.0
    for _ in range(4000):  # something pushes it further out all the time
        qdd = min(10.0, able(q, qd, 20.0, 20.0)[1])
        q, qd = q + qd * DT + 0.5 * qdd * DT**2, qd + qdd * DT
        fastest = max(fastest, -qd)
    assert 0.9 * PACE[2] < fastest < 1.1 * PACE[2]
    assert q == pytest.approx(LIMITS[1], abs=1e-3)
