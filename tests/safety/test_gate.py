"""Nothing leaves that the gate did not admit, and what it admits carries no more energy than allowed."""

from math import inf, isfinite, nan

import numpy as np
import pytest
from hapticd.safety import AxisLimits, Gate, Reaction
from numpy.typing import NDArray

JOINT = AxisLimits("joint_1", command=100.0, step=inf, power=200.0, lower=-1.0, upper=1.0)
KEPT = [False, False]
AXIS = AxisLimits("ppu_x", command=1.2, step=0.01, power=inf, lower=-1.6, upper=1.6)


def admit(
    gate: Gate,
    commands: list[float],
    position: list[float] | None = None,
    velocity: list[float] | None = None,
):  # type: ignore[no-untyped-def]
    return gate.admit(commands, position or [0.0, 0.0], velocity or [0.0, 0.0], True, 7, 7, KEPT)


def outputs() -> list[NDArray[np.float64]]:
    return [np.full(1, nan), np.full(1, nan)]


@pytest.fixture
def gate() -> Gate:
    return Gate([JOINT, AXIS], 1000.0, outputs())


def test_what_is_encoded_is_what_was_admitted_and_nothing_else() -> None:
    joint, axis = encoded = outputs()
    gate = Gate([JOINT, AXIS], 1000.0, encoded)
    gate.deny()
    assert (joint[0], axis[0]) == (0.0, 0.0)
    admit(gate, [150.0, nan])
    assert (joint[0], axis[0]) == (100.0, 0.0)
    admit(gate, [50.0, 0.005])
    assert (joint[0], axis[0]) == (50.0, 0.005)
    gate.admit([50.0, 0.005], [0.0, 0.0], [0.0, 0.0], True, 6, 7, KEPT)  # of another tick
    assert (joint[0], axis[0]) == (0.0, 0.0)


def test_an_axis_without_an_output_is_refused() -> None:
    with pytest.raises(ValueError, match="1 outputs for 2 axes"):
        Gate([JOINT, AXIS], 1000.0, outputs()[:1])


def test_without_arming_nothing_is_admitted(gate: Gate) -> None:
    admit(gate, [50.0, 0.005])
    verdict = gate.admit([50.0, 0.005], [0.0, 0.0], [0.0, 0.0], False, 7, 7, KEPT)
    assert gate.admitted.tolist() == [0.0, 0.0]
    assert not gate.enable
    assert verdict.reaction is Reaction.PASS


def test_an_ordinary_command_passes_unchanged(gate: Gate) -> None:
    assert admit(gate, [50.0, 0.005]).reaction is Reaction.PASS
    assert gate.admitted.tolist() == [50.0, 0.005]
    assert gate.enable


def test_an_output_of_another_tick_is_denied_and_stops(gate: Gate) -> None:
    admit(gate, [50.0, 0.005])
    verdict = gate.admit([50.0, 0.005], [0.0, 0.0], [0.0, 0.0], True, 6, 7, KEPT)
    assert (verdict.reaction, verdict.reason) == (Reaction.RAMP, "stale_output")
    assert gate.admitted.tolist() == [0.0, 0.0]
    assert not gate.enable


@pytest.mark.parametrize(
    ("command", "position", "velocity", "admitted", "why"),
    [
        (150.0, 0.0, 0.0, 100.0, "exceeds 100"),
        (-150.0, 0.0, 0.0, -100.0, "exceeds 100"),
        (100.0, 0.0, 0.0, 100.0, ""),
        (5.0, 1.01, 0.0, 0.0, "pushes further"),
        (-5.0, 1.01, 0.0, -5.0, ""),
        (-5.0, -1.01, 0.0, 0.0, "pushes further"),
        (5.0, -1.01, 0.0, 5.0, ""),
        (5.0, nan, 0.0, 0.0, "pushes further"),
        (-5.0, nan, 0.0, 0.0, "pushes further"),
        (80.0, 0.0, 4.0, 50.0, "exceeds 200 W"),
        (-80.0, 0.0, 4.0, -80.0, ""),  # brakes
        (-80.0, 0.0, -4.0, -50.0, "exceeds 200 W"),
        (80.0, 0.0, nan, 0.0, "exceeds 200 W"),
        (80.0, 0.0, 2.5, 80.0, ""),
    ],
)
def test_a_command_beyond_its_limits_is_replaced_by_a_weaker_one(
    gate: Gate, command: float, position: float, velocity: float, admitted: float, why: str
) -> None:
    verdict = admit(gate, [command, 0.0], [position, 0.0], [velocity, 0.0])
    assert gate.admitted[0] == pytest.approx(admitted)
    assert (verdict.reaction is Reaction.SANITISE) == bool(why)
    assert why in verdict.detail
    assert gate.clamps == bool(why)


def test_a_velocity_axis_may_not_jump(gate: Gate) -> None:
    verdict = admit(gate, [0.0, 0.5])
    assert gate.admitted[1] == pytest.approx(0.01)
    assert "jumps" in verdict.detail
    admit(gate, [0.0, -0.5])
    assert gate.admitted[1] == pytest.approx(0.0)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_what_is_no_number_holds_the_last_command_twice_and_then_takes_the_torque_off(
    gate: Gate, bad: float
) -> None:
    admit(gate, [50.0, 0.005])
    reactions = []
    for held in (50.0, 50.0, 0.0):
        reactions.append(admit(gate, [bad, 0.005]).reaction)
        assert gate.admitted.tolist() == [held, 0.005]
    assert reactions == [Reaction.SANITISE, Reaction.SANITISE, Reaction.OFF]


def test_clamped_ticks_stop_ever_more_strongly_and_a_good_tick_forgives_only_the_first(gate: Gate) -> None:
    for _ in range(9):
        assert admit(gate, [150.0, 0.0]).reaction is Reaction.SANITISE
    assert admit(gate, [50.0, 0.0]).reaction is Reaction.PASS
    found = [admit(gate, [150.0, 0.0]) for _ in range(155)]
    assert [verdict.reaction for verdict in found] == [
        *[Reaction.SANITISE] * 9,
        *[Reaction.HOLD] * 81,  # the nine before the good tick count, too
        *[Reaction.RAMP] * 50,
        *[Reaction.OFF] * 15,
    ]
    assert {verdict.reason for verdict in found[9:]} == {"output_beyond_limit"}
    assert gate.clamps == 164


@pytest.mark.parametrize(("rate", "ticks"), [(4000.0, 40), (1250.0, 13), (250.0, 10)])
def test_a_motor_may_give_all_it_has_for_10_ticks_and_for_10_ms(rate: float, ticks: int) -> None:
    gate = Gate([JOINT, AXIS], rate, outputs())
    found = [admit(gate, [150.0, 0.0]).reaction for _ in range(ticks)]
    assert found == [*[Reaction.SANITISE] * (ticks - 1), Reaction.HOLD]


def test_what_is_no_number_now_and_then_leads_to_a_ramp(gate: Gate) -> None:
    found = [admit(gate, [command, 0.0]) for command in (nan, nan, 50.0, nan, 50.0, nan)]
    assert [verdict.reaction for verdict in found] == [
        *(Reaction.SANITISE, Reaction.SANITISE, Reaction.PASS),
        *[Reaction.RAMP] * 3,
    ]
    assert {verdict.reason for verdict in found[3:]} == {"output_not_finite"}
    assert gate.admitted.tolist() == [50.0, 0.0]  # something to ramp with is left


def test_what_is_rarely_no_number_is_held_over(gate: Gate) -> None:
    found = [admit(gate, [nan if k % 50 == 0 else 50.0, 0.0]).reaction for k in range(500)]
    assert set(found) == {Reaction.SANITISE, Reaction.PASS}


@pytest.mark.parametrize(("good", "every", "stops"), [(1, 10, True), (1, 2, True), (9, 10, False)])
def test_commands_that_are_good_now_and_then_stop_all_the_same(
    gate: Gate, good: int, every: int, stops: bool
) -> None:
    commands = [50.0 if k % every < good else 150.0 for k in range(100)]
    found = [admit(gate, [command, 0.0]) for command in commands]
    assert any(verdict.reaction.stops for verdict in found) == stops
    assert {verdict.reason for verdict in found if verdict.reaction.stops} <= {"output_beyond_limit"}


def test_an_axis_that_was_dropped_gets_nothing_at_once_and_its_commands_do_not_count(gate: Gate) -> None:
    for k in range(100):
        admit(gate, [50.0, 0.0099 * k])
    assert gate.admitted[1] > 0.9
    for command in (0.5, nan, 1e9) * 100:
        verdict = gate.admit([50.0, command], [0.0, 0.0], [0.0, 0.0], True, 7, 7, [False, True])
        assert (verdict.reaction, gate.admitted.tolist()) == (Reaction.PASS, [50.0, 0.0])


@pytest.mark.parametrize(("bad", "harmless"), [(150.0, 9), (nan, 2)])
def test_a_new_arming_counts_from_nothing(gate: Gate, bad: float, harmless: int) -> None:
    for _ in range(3):
        for _ in range(harmless):
            assert admit(gate, [bad, 0.0]).reaction is Reaction.SANITISE
        gate.admit([0.0, 0.0], [0.0, 0.0], [0.0, 0.0], False, 7, 7, KEPT)


def test_whatever_comes_in_nothing_beyond_the_limits_goes_out(gate: Gate) -> None:
    rng = np.random.default_rng(11)
    strange = [nan, inf, -inf, 0.0, -0.0, 1e308, -1e308, 5e-324]
    for _ in range(20_000):
        pick = [float(rng.choice(strange) if rng.random() < 0.3 else rng.normal(0, 200)) for _ in range(6)]
        last = gate.admitted[1]
        gate.admit(pick[:2], pick[2:4], pick[4:], True, 1, 1, KEPT)
        torque, velocity = gate.admitted
        assert isfinite(torque) and abs(torque) <= JOINT.command
        assert isfinite(velocity) and abs(velocity) <= AXIS.command
        # a step down to zero at a limit is the only larger one
        assert abs(velocity - last) <= AXIS.step + 1e-12 or velocity == 0.0
