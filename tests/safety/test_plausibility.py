"""What is measured passes range, rate, standstill and agreement, or is replaced before anyone reads it."""

from collections.abc import Sequence
from math import inf, nan

import numpy as np
import pytest
from hapticd.binding import BindError
from hapticd.safety import Axes, Course, Motion, Pairs, Plausibility, Values
from hapticd.safety.plausibility import FRESH_TICKS, FROZEN_TICKS

DT = 1e-3
STEP = 3.75e-3
"""1.5 times what 2.5 rad/s are in a tick."""


class Encoder:
    """Two axes of two devices with position and velocity."""

    def __init__(self) -> None:
        self.position, self.velocity = np.array([0.5, -1.0]), np.zeros(2)
        # as the process image keeps it: one field of many
        status = np.zeros(2, [("missed", np.int32), ("fresh", np.bool_)])
        self.fresh = status["fresh"]
        self.fresh[:] = True
        self.rate = Values(self.velocity, [0, 1], self.fresh, [3.75, 3.75], [1.25, 1.25])
        self.values = Values(self.position, [0, 1], self.fresh, [inf, inf], [STEP, STEP], self.rate, DT)

    def tick(self, position: Sequence[float], velocity: Sequence[float], elapsed: int = 1) -> list[bool]:
        self.position[:], self.velocity[:] = position, velocity
        self.rate.accept(elapsed)
        self.values.accept(elapsed)
        return self.values.rejected.tolist()


@pytest.fixture
def encoder() -> Encoder:
    found = Encoder()
    found.tick([0.5, -1.0], [1.0, 0.0])
    return found


def test_the_first_value_is_taken_wherever_it_is_and_motion_is_taken_as_it_comes() -> None:
    encoder = Encoder()
    assert not encoder.values.current
    for k in range(100):
        assert encoder.tick([7.0 + STEP * k * 0.999, -9.0 - 1e-3 * k], [2.5, -1.0]) == [False, False]
        assert encoder.values.current
    assert encoder.values.age.tolist() == [0, 0]


@pytest.mark.parametrize("wrong", [0.5 + 1.01 * STEP + 1e-3, 0.4, 1e9, nan, inf, -inf])
def test_a_jump_is_replaced_by_the_last_value_extrapolated_and_the_next_one_is_taken(
    encoder: Encoder, wrong: float
) -> None:
    assert encoder.tick([wrong, -1.0], [1.0, 0.0]) == [True, False]
    assert encoder.position.tolist() == [pytest.approx(0.501), -1.0]
    assert not encoder.values.current
    assert encoder.values.age.tolist() == [1, 0]
    assert encoder.tick([0.502, -1.0], [1.0, 0.0]) == [False, False]
    assert encoder.position.tolist() == [0.502, -1.0]
    assert encoder.values.age.tolist() == [0, 0]


@pytest.mark.parametrize(("velocity", "taken"), [(1.0 + 1.24, True), (1.0 + 1.26, False), (nan, False)])
def test_a_velocity_may_not_jump_either(encoder: Encoder, velocity: float, taken: bool) -> None:
    encoder.tick([0.501, -1.0], [velocity, 0.0])
    assert encoder.velocity[0] == (velocity if taken else 1.0)


def test_a_velocity_beyond_its_range_is_never_taken(encoder: Encoder) -> None:
    for k in range(20):
        encoder.tick([0.5, -1.0], [min(1.0 + k, 3.76), -3.75 if k > 2 else -1.25 * k])
    assert encoder.rate.rejected.tolist() == [True, False]
    assert encoder.velocity.tolist() == [3.0, -3.75]


def test_what_jumped_away_is_not_followed_further_than_a_stop_may_look(encoder: Encoder) -> None:
    for k in range(1, 10):
        assert encoder.tick([5.0, -1.0], [1.0, 0.0]) == [True, False]
        assert encoder.position[0] == pytest.approx(0.5 + 1e-3 * min(k, FRESH_TICKS))


def test_what_was_not_heard_of_for_longer_may_have_moved_further(encoder: Encoder) -> None:
    encoder.fresh[0] = False
    for k in range(4):
        assert encoder.tick([0.5, -1.0], [1.0, 0.0]) == [False, False]
        assert encoder.values.age.tolist() == [k + 1, 0]
        assert not encoder.values.current
    encoder.fresh[0] = True
    assert encoder.tick([0.5 + 5.01 * STEP, -1.0], [1.0, 0.0]) == [True, False]
    assert encoder.tick([0.5 + 5.9 * STEP, -1.0], [1.0, 0.0]) == [False, False]
    assert encoder.tick([0.5 + 11.8 * STEP, -1.0], [1.0, 0.0], elapsed=6) == [False, False]
    encoder.tick([0.5, -1.0], [0.0, 0.0], elapsed=2**31 - 1)  # no overflow
    assert encoder.values.age.tolist() == [0, 0]


def test_measurements_that_would_be_watched_in_a_copy_are_refused() -> None:
    fresh, both = np.ones(2, np.bool_), np.zeros((2, 2))
    two = [1.0, 1.0]
    with pytest.raises(BindError, match="values is not C-contiguous"):
        Values(both[:, 0], [0, 1], fresh, two, two)
    still = Values(both[0], [0, 1], fresh, two, two)
    assert still.value.base is both
    for name in ("position", "velocity", "command"):
        arrays = {"position": both[0], "velocity": both[0], "command": both[0], name: both[:, 1]}
        with pytest.raises(BindError, match=rf"plausible_motion\.{name} is not C-contiguous"):
            Motion(*arrays.values(), None, two, two, two, 1e-3)


def test_a_value_that_never_was_one_reads_as_zero() -> None:
    encoder = Encoder()
    encoder.tick([nan, 0.0], [nan, 0.0])
    assert encoder.position.tolist() == [0.0, 0.0]
    assert encoder.velocity.tolist() == [0.0, 0.0]


class Moving:
    """An axis with an encoder, its command, and what balances it."""

    def __init__(self, opposing: bool = True) -> None:
        self.position, self.velocity, self.command, self.opposing = (np.zeros(1) for _ in range(4))
        numbers = [26.0], [2.5e-6], [2.5e-4]
        balance = self.opposing if opposing else None
        self.motion = Motion(self.position, self.velocity, self.command, balance, *numbers, DT)

    def frozen_at(self, ticks: int, free: bool = True) -> int | None:
        """The tick that finds it frozen, None where none does."""
        return next((k for k in range(1, ticks + 1) if not self.motion.fine(free)), None)


@pytest.fixture
def moving() -> Moving:
    found = Moving()
    assert found.motion.fine(True)  # it gets there
    return found


@pytest.mark.parametrize(("command", "opposing"), [(27.0, 0.0), (-27.0, 0.0), (10.0, -17.0), (50.0, 23.0)])
def test_an_encoder_that_stands_still_while_torque_acts_is_frozen(
    moving: Moving, command: float, opposing: float
) -> None:
    moving.command[:], moving.opposing[:] = command, opposing
    assert moving.frozen_at(100) == FROZEN_TICKS
    assert moving.motion.frozen.tolist() == [True]
    moving.position[:] = 3e-6
    assert moving.frozen_at(FROZEN_TICKS) is None  # it moves again, and then counts anew
    assert moving.frozen_at(1) == 1


@pytest.mark.parametrize(
    ("command", "opposing", "free"),
    [(100.0, 90.0, True), (25.0, 0.0, True), (100.0, 0.0, False), (0.0, 100.0, True)],
    ids=["balanced", "friction may hold it", "brakes closed", "the drive is told nothing"],
)
def test_an_axis_that_nothing_moves_may_stand_still(
    moving: Moving, command: float, opposing: float, free: bool
) -> None:
    moving.command[:], moving.opposing[:] = command, opposing
    assert moving.frozen_at(500, free) is None


def test_a_torque_that_trembles_moves_nothing(moving: Moving) -> None:
    for k in range(500):
        moving.command[:] = 100.0 if k // 15 % 2 else -100.0
        assert moving.frozen_at(1) is None


def test_an_encoder_that_stands_still_while_the_axis_has_a_speed_is_frozen(moving: Moving) -> None:
    moving.velocity[:] = -0.0126
    assert moving.frozen_at(100, free=False) == FROZEN_TICKS
    other = Moving()
    other.velocity[:] = 0.0124
    assert other.frozen_at(20) is None  # not far enough to be sure
    assert other.frozen_at(5) is not None


def test_an_encoder_that_trembles_by_less_than_an_increment_is_frozen_too() -> None:
    moving = Moving(opposing=False)
    moving.command[:] = 30.0
    found = []
    for k in range(30):
        moving.position[:] = 2e-6 * (k % 2)
        found.append(moving.motion.fine(True))
    assert found == [True] * 20 + [False] * 10


@pytest.mark.parametrize(
    ("motor", "link", "load", "fine"),
    [
        (0.10, 0.10, 0.0, True),
        (0.10, 0.09, 150.0, True),
        (0.10, 0.09, 130.0, True),
        (0.10, 0.09, 100.0, False),
        (0.10, 0.12, 0.0, False),
        (nan, 0.10, 0.0, False),
        (0.10, 0.10, nan, False),
    ],
)
def test_encoders_on_both_sides_of_a_spring_agree_with_its_torque_or_contradict_each_other(
    motor: float, link: float, load: float, fine: bool
) -> None:
    arrays = (np.array([value, 0.0]) for value in (motor, link, load))
    pairs = Pairs(*arrays, [1 / 15000, 0.0], [1.7e-3, 1e-3])
    assert pairs.fine() == fine
    assert pairs.mismatched.tolist() == [not fine, False]


def test_a_torque_that_stands_still_while_its_spring_yields_contradicts_it() -> None:
    motor, link, load = np.array([0.1]), np.array([0.09]), np.array([150.0])
    pairs = Pairs(motor, link, load, [1 / 15000], [1.7e-3], ([2.6], [0.87e-3]))
    for by in (0.0, 0.4e-3, 0.8e-3):
        motor[0] = 0.1 + by
        assert pairs.fine()
    motor[0] = 0.1 + 1.0e-3  # within the tolerance, but the torque never moved
    assert not pairs.fine()
    load[0] = 165.0
    assert pairs.fine()


def test_a_spring_that_relaxes_after_its_torque_is_none_whose_sensor_froze() -> None:
    """The deflection lags by two ticks behind a torque that falls and then stays; then the sensor freezes."""
    motor, link, load = np.array([0.1]), np.array([0.1]), np.array([0.0])
    pairs = Pairs(motor, link, load, [1 / 9000], [1.7e-3], ([2.6], [0.87e-3]), 2.0)
    torques = [80.0, 80.0, 80.0, 74.0, 68.0, 62.0, 56.0, 50.0] + [50.0] * 12
    for k, torque in enumerate(torques):
        load[0], motor[0] = torque, 0.1 + torques[max(0, k - 2)] / 9000
        assert pairs.fine(), k
    for _ in range(5):
        motor[0] += 0.6e-3
        last = pairs.fine()
    assert not last


class Compared:
    """An axis whose position and velocity are compared over ten ticks."""

    def __init__(self) -> None:
        self.x, self.v, self.fresh = np.zeros(1), np.zeros(1), np.ones(1, bool)
        rate = Values(self.v, [0], self.fresh, [10.0], [inf])
        place = Values(self.x, [0], self.fresh, [inf], [inf])
        self.values = rate, place
        self.course = Course(place, rate, [2.5e-3], 10, DT)

    def tick(self, x: float, v: float, elapsed: int = 1) -> bool:
        self.x[:], self.v[:] = x, v
        for values in self.values:
            values.accept(elapsed)
        return self.course.fine(elapsed)


def test_a_velocity_is_compared_with_the_change_of_position() -> None:
    axis = Compared()
    x = 5.0
    for k in range(100):  # whatever it does
        v = 2.5 * np.sin(0.1 * k)
        x += 0.5 * DT * (v + 2.5 * np.sin(0.1 * (k - 1)))
        assert axis.tick(x, v)
    found = next(k for k in range(20) if not axis.tick(x := x - DT * 2.0, 2.0))
    assert found <= 5
    assert axis.course.wrong.tolist() == [True]


@pytest.mark.parametrize("wrong", [(5e-3, 1.0), (0.0, 1.0 + 2.4)])
def test_one_wrong_sample_of_position_or_velocity_contradicts_nothing(wrong: tuple[float, float]) -> None:
    axis = Compared()
    for k in range(60):
        dx, v = wrong if k == 30 else (0.0, 1.0)
        assert axis.tick(k * DT + dx, v)


def test_an_axis_that_was_not_measured_for_a_while_is_compared_anew() -> None:
    axis = Compared()
    for k in range(20):
        assert axis.tick(k * DT, 1.0)
    assert axis.tick(0.5, -1.0, elapsed=50)
    for k in range(1, 30):
        assert axis.tick(0.5 - k * DT, -1.0)


def test_skipped_ticks_in_which_the_plant_may_have_stood_still_contradict_nothing() -> None:
    axis, x = Compared(), 0.0
    for k in range(100):
        x += 2.5 * DT  # one period, whatever was skipped
        assert axis.tick(x, 2.5, elapsed=2 if k % 3 else 1)


def test_skipped_ticks_hide_no_velocity_that_is_turned_over() -> None:
    axis, x = Compared(), 0.0
    for k in range(60):
        axis.tick(x := x + 2.0 * DT, 2.0, elapsed=3 if k % 3 == 0 else 1)
    found = [axis.tick(x := x + 2.0 * DT, -2.0, elapsed=3 if k % 3 == 0 else 1) for k in range(20)]
    assert not all(found)


def test_the_speed_of_an_axis_is_that_of_what_moves_faster() -> None:
    axis = Compared()
    axis.tick(0.0, 0.0)
    for k in range(1, 11):
        axis.tick(k * 2e-4, 0.0)
    assert axis.course.speed.tolist() == [pytest.approx(0.2)]
    axis.tick(11 * 2e-4, -0.7)
    assert axis.course.speed.tolist() == [0.7]


def test_a_motion_that_is_faster_than_it_may_be_is_taken_where_its_velocity_says_so(encoder: Encoder) -> None:
    x, v = 0.5, 1.0
    encoder.rate._core.most[0] = 10.0
    for _ in range(6):
        v += 1.2
        x += DT * v
        assert encoder.tick([x, -1.0], [v, 0.0]) == [False, False]
    assert v * DT > 1.9 * STEP
    assert encoder.tick([x - DT * v, -1.0], [v, 0.0]) == [True, False]


class Machine:
    """Two joints with two encoders each, and an axis with one; a sensor."""

    def __init__(self) -> None:
        self.joint, self.link, self.rate, self.load, self.torque = (np.zeros(2) for _ in range(5))
        self.axis, self.speed, self.told = np.zeros(1), np.zeros(1), np.zeros(1)
        self.wrench = np.zeros((1, 3))
        self.fresh = np.ones(4, bool)
        big, step = [inf, inf], [STEP, STEP]
        joints = [0, 1]
        rate = Values(self.rate, joints, self.fresh, big, [1.0, 1.0])
        motor = Values(self.joint, joints, self.fresh, big, step, rate, DT)
        link = Values(self.link, joints, self.fresh, big, step, rate, DT)
        arm = Axes(
            [rate, motor, link],
            [
                Motion(position, self.rate, self.torque, None, [26.0] * 2, [1e-6] * 2, [1e-3] * 2, DT)
                for position in (self.joint, self.link)
            ],
            [Course(place, rate, [2.5e-3, 2.5e-3], 10, DT) for place in (motor, link)],
            [Pairs(self.joint, self.link, self.load, [0.0, 0.0], [1e-3, 1e-3])],
        )
        speed = Values(self.speed, [2], self.fresh, [inf], [1.0])
        axis = Values(self.axis, [2], self.fresh, [inf], [STEP], speed, DT)
        base = Axes(
            [speed, axis],
            [Motion(self.axis, self.speed, self.told, None, [0.1], [1e-6], [1e-3], DT)],
            [Course(axis, speed, [2.5e-3], 10, DT)],
        )
        self.sensor = Values(self.wrench, [3] * 3, self.fresh, [100.0] * 3, [25.0] * 3)
        self.checks = Plausibility((arm, base), (self.sensor,))

    def tick(self, elapsed: int = 1) -> tuple[list[bool], list[bool], list[bool], list[bool]]:
        self.checks.accept(elapsed, True)
        found = self.checks.findings
        marks = found.rejected, found.mismatched, found.frozen, found.stale
        rejected, mismatched, frozen, stale = (each or NONE for each in marks)
        return rejected, mismatched, frozen, stale


NONE = [False] * 3


def test_a_machine_at_rest_gives_no_findings() -> None:
    machine = Machine()
    assert machine.tick() == (NONE, NONE, NONE, NONE)
    calm = machine.checks.findings
    for _ in range(50):
        machine.tick()
        assert machine.checks.findings is calm


def test_what_axes_did_while_nobody_looked_makes_no_encoder_frozen() -> None:
    machine = Machine()
    machine.tick()
    machine.speed[:], machine.told[:] = 0.5, 1.0
    assert machine.tick() == (NONE, NONE, NONE, NONE)
    assert machine.tick(elapsed=700) == (NONE, NONE, NONE, NONE)


def test_findings_name_the_axis() -> None:
    machine = Machine()
    machine.tick()
    machine.link[1] = 1.0
    assert machine.tick() == ([False, True, False], NONE, NONE, NONE)
    assert machine.link[1] == 0.0
    machine.axis[0] = 1.0
    assert machine.tick() == ([False, False, True], NONE, NONE, NONE)
    machine.link[0] = 0.9 * STEP
    assert machine.tick() == (NONE, [True, False, False], NONE, NONE)


def test_an_axis_is_stale_when_any_of_its_measurements_is_older_than_three_ticks() -> None:
    machine = Machine()
    machine.tick()
    machine.fresh[2] = False
    for _ in range(FRESH_TICKS):
        assert machine.tick() == (NONE, NONE, NONE, NONE)
    assert machine.tick() == (NONE, NONE, NONE, [False, False, True])
    machine.fresh[2] = True
    for k in range(FRESH_TICKS + 1):
        machine.link[0] = 5.0  # it answers, but what it says is no measurement
        assert machine.tick() == ([True, False, False], NONE, NONE, [k == FRESH_TICKS, False, False])


def test_a_frozen_axis_is_found_in_its_group() -> None:
    machine = Machine()
    machine.told[0] = 0.5
    for _ in range(FROZEN_TICKS):
        assert machine.tick() == (NONE, NONE, NONE, NONE)
    assert machine.tick() == (NONE, NONE, [False, False, True], NONE)


def test_a_sensor_that_jumps_or_is_silent_is_not_current_and_keeps_its_last_values() -> None:
    machine = Machine()
    machine.wrench[:] = [[1.0, 2.0, 3.0]]
    assert machine.tick() == (NONE, NONE, NONE, NONE)
    assert machine.sensor.current
    machine.wrench[0, 1] = nan
    machine.tick()
    assert not machine.sensor.current
    assert machine.wrench.tolist() == [[1.0, 2.0, 3.0]]
    machine.wrench[0, 1] = 2.0 + 2 * 25.1
    machine.tick()
    assert not machine.sensor.current
    machine.wrench[0, 1] = 2.0 + 24.9
    machine.tick()
    assert machine.sensor.current
    machine.fresh[3] = False
    machine.tick()
    assert not machine.sensor.current


def test_a_coarse_encoder_has_longer_to_see_what_a_torque_does() -> None:
    both = [np.zeros(2) for _ in range(3)]
    both[2][:] = 30.0
    motion = Motion(*both, None, [26.0] * 2, [1e-6] * 2, [1e-3] * 2, DT, patience=[FROZEN_TICKS, 55])
    found = []
    for _ in range(60):
        motion.fine(True)
        found.append(motion.frozen.tolist())
    assert [frozen.index(True) for frozen in zip(*found, strict=True)] == [FROZEN_TICKS, 55]
