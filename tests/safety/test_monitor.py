"""Every check of the monitor, at and around its threshold (docs/fault-matrix.md, rows 1 to 19 and 25)."""

from dataclasses import replace
from math import inf, nan

import pytest
from hapticd.safety import Monitor, Observation, Reaction, Thresholds

THRESHOLDS = Thresholds(
    axes=("joint_1", "ppu_x"),
    lower=(-inf, -1.6),
    upper=(inf, 1.6),
    speed=(2.75, 1.3),
    motor_speed=(3.6, 1.3),
    devices=("joint_1", "ppu_x", "safety_plc"),
    rate=1000.0,
    overruns_stop=True,
)


def good(**changes: object) -> Observation:
    seen = Observation(
        missed=[0, 0, 0],
        faults=[0, 0, 0],
        lost=[False] * 3,
        rejected=[False] * 2,
        mismatched=[False] * 2,
        frozen=[False] * 2,
        stale=[False] * 2,
        position=[0.1, 0.2],
        velocity=[0.0, 0.0],
        way=[0.0, 0.0],
        armed=True,
        dead_man=True,
        e_stop=False,
        supervised=True,
        guarded=False,
        field_clear=True,
        sto=False,
        wrench=[0.0] * 6,
        inertial=True,
    )
    return replace(seen, **changes)


@pytest.fixture
def monitor() -> Monitor:
    return Monitor(THRESHOLDS)


def reactions(monitor: Monitor, count: int, **changes: object) -> list[Reaction]:
    return [monitor.judge(good(**changes)).reaction for _ in range(count)]


def test_a_healthy_machine_passes(monitor: Monitor) -> None:
    assert reactions(monitor, 500) == [Reaction.PASS] * 500


@pytest.mark.parametrize(
    ("changes", "reaction", "reason"),
    [
        ({"e_stop": True}, Reaction.OFF, "e_stop"),
        ({"e_stop": True, "armed": False}, Reaction.OFF, "e_stop"),
        ({"sto": True}, Reaction.OFF, "sto"),
        ({"sto": True, "armed": False}, Reaction.PASS, ""),
        ({"dead_man": False}, Reaction.RAMP, "dead_man"),
        ({"field_clear": False}, Reaction.PASS, ""),
        ({"field_clear": False, "guarded": True}, Reaction.RAMP, "scanner"),
        ({"field_clear": False, "guarded": True, "armed": False}, Reaction.PASS, ""),
        ({"dead_man": False, "overriding": True}, Reaction.PASS, ""),
        ({"supervised": False}, Reaction.RAMP, "supervisor"),
        ({"supervised": False, "overriding": True}, Reaction.RAMP, "supervisor"),
        ({"supervised": False, "armed": False}, Reaction.PASS, ""),
        ({"inertial": False}, Reaction.SANITISE, "acceleration_invalid"),
        ({"dead_man": False, "armed": False}, Reaction.PASS, ""),
        ({"faults": [0, 0x8130, 0]}, Reaction.RAMP, "device_fault"),
        ({"lost": [False, False, True]}, Reaction.RAMP, "device_state"),
        ({"lost": [False, False, True], "armed": False}, Reaction.PASS, ""),
        ({"foreign": 1}, Reaction.RAMP, "second_master"),
        ({"discarded": 1}, Reaction.SANITISE, "frame_discarded"),
        ({"discarded": 12}, Reaction.SANITISE, "frame_discarded"),
        ({"rejected": [False, True]}, Reaction.SANITISE, "encoder_jump"),
        ({"mismatched": [True, False]}, Reaction.RECORD, "encoder_mismatch"),
        ({"frozen": [False, True]}, Reaction.RAMP, "encoder_frozen"),
        ({"frozen": [False, True], "armed": False}, Reaction.RAMP, "encoder_frozen"),
        ({"skipped": 1}, Reaction.RECORD, "overrun"),
        ({"skipped": 3}, Reaction.HOLD, "overrun"),
        ({"skipped": 19}, Reaction.HOLD, "overrun"),
        ({"skipped": 20}, Reaction.RAMP, "stall"),
        ({"skipped": 20, "armed": False}, Reaction.RECORD, "overrun"),
        ({"solved": False}, Reaction.SANITISE, "solve_failed"),
        ({"pressed": "a link is pushed towards the floor"}, Reaction.RAMP, "collision_ahead"),
        ({"ahead": "a link would have met the floor"}, Reaction.HOLD, "collision_ahead"),
    ],
)
def test_a_single_finding_has_its_reaction(
    monitor: Monitor, changes: dict[str, object], reaction: Reaction, reason: str
) -> None:
    verdict = monitor.judge(good(**changes))
    assert (verdict.reaction, verdict.reason) == (reaction, reason)
    assert bool(verdict.detail) == bool(reason)


@pytest.mark.parametrize(
    ("count", "reaction"),
    [
        (1, Reaction.SANITISE),
        (4, Reaction.SANITISE),
        (5, Reaction.HOLD),
        (19, Reaction.HOLD),
        (20, Reaction.RAMP),
    ],
)
def test_missing_frames_escalate_and_name_the_device(
    monitor: Monitor, count: int, reaction: Reaction
) -> None:
    verdict = monitor.judge(good(missed=[0, count, 0]))
    assert verdict.reaction is reaction
    assert f"{count} frames of ppu_x" in verdict.detail


def test_times_are_times_at_any_rate() -> None:
    for rate, ticks in ((500.0, 10), (4000.0, 80)):
        monitor = Monitor(replace(THRESHOLDS, rate=rate))
        for k in range(1, ticks + 1):
            reaction = monitor.judge(good(missed=[k, 0, 0])).reaction
            assert (reaction is Reaction.RAMP) == (k == ticks)
        monitor = Monitor(replace(THRESHOLDS, rate=rate))
        assert monitor.judge(good(skipped=ticks - 1)).reaction is Reaction.HOLD
        assert monitor.judge(good(skipped=ticks)).reaction is Reaction.RAMP
        monitor = Monitor(replace(THRESHOLDS, rate=rate))
        assert reactions(monitor, ticks, wrench=None) == [Reaction.SANITISE] * ticks
        assert monitor.trust.wrench == pytest.approx(0.0)
        assert reactions(monitor, 1, wrench=None) == [Reaction.HOLD]


@pytest.mark.parametrize(
    "changes",
    [
        {"position": [0.0, 1.7]},
        {"position": [nan, 0.0]},
        {"velocity": [3.7, 0.0]},
        {"velocity": [0.0, nan]},
        {"way": [2.8, 0.0]},
        {"way": [0.0, nan]},
    ],
)
def test_three_ticks_past_a_hard_limit_stop(monitor: Monitor, changes: dict[str, object]) -> None:
    assert reactions(monitor, 3, **changes) == [Reaction.RECORD, Reaction.RECORD, Reaction.RAMP]
    assert monitor.judge(good()).reaction is Reaction.PASS
    assert reactions(monitor, 2, **changes) == [Reaction.RECORD, Reaction.RECORD]
    assert monitor.judge(good()).reaction is Reaction.PASS
    assert reactions(monitor, 1, **changes) == [Reaction.RAMP]  # the sixth within a hundred


def test_a_motor_before_a_spring_may_turn_a_little_faster_than_its_axis(monitor: Monitor) -> None:
    assert reactions(monitor, 10, velocity=[3.5, 0.0], way=[2.7, 0.0]) == [Reaction.PASS] * 10
    assert reactions(monitor, 3, velocity=[0.0, 1.35])[-1] is Reaction.RAMP  # nothing gives in a gantry


def test_an_axis_that_does_not_follow_for_five_ticks_stops(monitor: Monitor) -> None:
    assert reactions(monitor, 4, astray=[True, False]) == [Reaction.PASS] * 4
    assert monitor.judge(good(astray=[False, False])).reaction is Reaction.PASS
    assert reactions(monitor, 5, astray=[False, True]) == [Reaction.PASS] * 4 + [Reaction.RAMP]
    verdict = monitor.judge(good(astray=[False, True]))
    assert (verdict.reason, "ppu_x does not follow" in verdict.detail) == ("not_following", True)


def test_an_idle_machine_past_its_limits_is_only_recorded(monitor: Monitor) -> None:
    assert set(reactions(monitor, 10, position=[0.0, 1.7], armed=False)) == {Reaction.RECORD}


@pytest.mark.parametrize("wrench", [None, [nan, 0, 0, 0, 0, 0], [0, 0, 0, inf, 0, 0]])
def test_an_invalid_wrench_fades_out_and_then_stops(monitor: Monitor, wrench: list[float] | None) -> None:
    gains = []
    for _ in range(20):
        assert monitor.judge(good(wrench=wrench)).reaction is Reaction.SANITISE
        gains.append(monitor.trust.wrench)
    assert gains == pytest.approx([1 - k / 20 for k in range(1, 21)])
    assert monitor.judge(good(wrench=wrench)).reaction is Reaction.HOLD
    for k in range(1, 21):  # and comes back as it went: no jump
        monitor.judge(good())
        assert monitor.trust.wrench == pytest.approx(k / 20)
    assert monitor.trust.wrench == 1.0
    assert reactions(monitor, 100)[-1] is Reaction.PASS


def test_accelerometers_without_valid_values_stop_after_a_while(monitor: Monitor) -> None:
    assert reactions(monitor, 20, inertial=False) == [Reaction.SANITISE] * 20
    verdict = monitor.judge(good(inertial=False))
    assert (verdict.reaction, verdict.reason) == (Reaction.HOLD, "acceleration_lost")
    assert monitor.trust.wrench == 1.0
    assert reactions(monitor, 100)[-1] is Reaction.PASS
    assert reactions(monitor, 20, inertial=False) == [Reaction.SANITISE] * 20
    assert reactions(monitor, 30, inertial=False, armed=False) == [Reaction.SANITISE] * 30


def test_without_power_an_invalid_wrench_does_not_stop(monitor: Monitor) -> None:
    assert set(reactions(monitor, 30, wrench=None, armed=False)) == {Reaction.SANITISE}


def test_failed_solves_escalate(monitor: Monitor) -> None:
    found = reactions(monitor, 10, solved=False)
    assert found == [Reaction.SANITISE] * 2 + [Reaction.HOLD] * 7 + [Reaction.RAMP]
    assert reactions(monitor, 101)[-1] is Reaction.PASS


def sporadic(monitor: Monitor, every: int, **changes: object) -> list[Reaction]:
    return [monitor.judge(good(**changes) if k % every == 0 else good()).reaction for k in range(600)]


SPORADIC: dict[str, dict[str, object]] = {
    "skipped ticks": {"skipped": 1},
    "stale frames": {"discarded": 1},
    "missing frames": {"missed": [0, 1, 0]},
    "failed solves": {"solved": False},
}


@pytest.mark.parametrize("name", SPORADIC)
def test_more_than_five_sporadic_faults_in_a_hundred_ticks_stop_and_fewer_do_not(name: str) -> None:
    assert Reaction.HOLD not in sporadic(Monitor(THRESHOLDS), 20, **SPORADIC[name])
    assert Reaction.HOLD in sporadic(Monitor(THRESHOLDS), 16, **SPORADIC[name])


def test_frames_of_different_devices_count_by_themselves(monitor: Monitor) -> None:
    for k in range(15):
        missed = [int(k % 3 == i) for i in range(3)]
        assert monitor.judge(good(missed=missed)).reaction is Reaction.SANITISE
    verdict = monitor.judge(good(missed=[0, 1, 0]))
    assert (verdict.reaction, verdict.reason) == (Reaction.HOLD, "device_silent")
    assert "ppu_x: 6 of 100" in verdict.detail


def test_when_no_axis_is_measured_any_more_nothing_is_held(monitor: Monitor) -> None:
    missed, stale = [5, 5, 5], [True, True]
    assert monitor.judge(good(missed=missed, stale=stale)).reaction is Reaction.RAMP
    assert monitor.trust.axes == [False, False]
    assert Monitor(THRESHOLDS).judge(good(missed=[4] * 3, stale=stale)).reaction is Reaction.SANITISE
    assert Monitor(THRESHOLDS).judge(good(missed=missed, stale=[True, False])).reaction is Reaction.HOLD


@pytest.mark.parametrize("gap", [1, 2, 50, 98])
def test_a_second_implausible_measurement_of_an_axis_stops(gap: int) -> None:
    monitor = Monitor(THRESHOLDS)
    bad = {"rejected": [False, True]}
    assert reactions(monitor, 1, **bad) == [Reaction.SANITISE]
    assert reactions(monitor, 1, rejected=[True, False]) == [Reaction.SANITISE]  # of the other axis
    assert reactions(monitor, gap - 1) == [Reaction.PASS] * (gap - 1)
    verdict = monitor.judge(good(**bad))
    assert (verdict.reaction, verdict.reason) == (Reaction.RAMP, "encoder_jump")
    assert "ppu_x: 2 of 100" in verdict.detail
    assert monitor.trust.axes == [True, False]  # a stop does not steer by it


def test_implausible_measurements_far_apart_stop_nothing(monitor: Monitor) -> None:
    for _ in range(5):
        assert reactions(monitor, 1, rejected=[True, False]) == [Reaction.SANITISE]
        assert reactions(monitor, 99) == [Reaction.PASS] * 99


@pytest.mark.parametrize("every", [1, 2, 9])
def test_encoders_that_contradict_each_other_ten_times_in_a_hundred_stop(every: int) -> None:
    monitor = Monitor(THRESHOLDS)
    for k in range(10):
        assert monitor.trust.axes == [True, True]
        found = reactions(monitor, 1, mismatched=[False, True])
        assert found == [Reaction.RECORD if k < 9 else Reaction.RAMP]
        if k < 9:
            assert reactions(monitor, every - 1) == [Reaction.PASS] * (every - 1)
    assert monitor.trust.axes == [True, False]


def test_a_frozen_encoder_costs_its_axis_the_trust_until_it_moves(monitor: Monitor) -> None:
    monitor.judge(good(frozen=[True, False]))
    assert monitor.trust.axes == [False, True]
    monitor.judge(good())
    assert monitor.trust.axes == [True, True]


@pytest.mark.parametrize("changes", [{"wrench": None}, {"inertial": False}])
def test_a_sensor_that_is_valid_now_and_then_stops_all_the_same(changes: dict[str, object]) -> None:
    assert Reaction.HOLD in sporadic(Monitor(THRESHOLDS), 4, **changes)
    assert Reaction.HOLD not in sporadic(Monitor(THRESHOLDS), 6, **changes)


def test_where_overruns_are_recorded_no_stall_stops() -> None:
    monitor = Monitor(replace(THRESHOLDS, overruns_stop=False))
    assert set(reactions(monitor, 50, skipped=100)) == {Reaction.RECORD}


@pytest.mark.parametrize(
    ("weaker", "stronger"),
    [
        ({"skipped": 3}, {"dead_man": False}),
        ({"dead_man": False}, {"e_stop": True}),
        ({"missed": [5, 0, 0]}, {"foreign": 2}),
        ({"solved": False}, {"missed": [0, 0, 20]}),
    ],
)
def test_of_two_findings_the_stronger_one_speaks(
    weaker: dict[str, object], stronger: dict[str, object]
) -> None:
    expected = Monitor(THRESHOLDS).judge(good(**stronger))
    assert Monitor(THRESHOLDS).judge(good(**weaker, **stronger)) == expected


def test_the_monitor_never_raises_whatever_numbers_it_sees() -> None:
    monitor = Monitor(THRESHOLDS)
    for value in (nan, inf, -inf, 1e308):
        strange = good(position=[value] * 2, velocity=[value] * 2, wrench=[value] * 6)
        assert monitor.judge(strange).reaction >= Reaction.RECORD
