"""More than the rated torque is given for a time, and the time is accounted for by the losses."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from hapticd.safety import AxisLimits, Gate, Heat, Peak, Reaction
from hapticd.safety.heat import ADMITTED, PLANNED

DT = 1e-3
PEAK = Peak(rated=10.0, torque=20.0, seconds=2.0)


def heat(lasting: float = 10.0, peak: Peak | None = PEAK, share: float = PLANNED) -> tuple[Heat, np.ndarray]:  # type: ignore[type-arg]
    told = np.zeros(1)
    return Heat(told, [lasting], [peak], share, DT), told


def test_the_peak_fills_the_budget_once_within_its_time_and_rest_empties_it() -> None:
    budget, told = heat()
    told[0] = -20.0
    for _ in range(2000):
        budget.take(1)
    assert budget.used[0] == pytest.approx(1.0)
    told[0] = 10.0
    budget.take(5000)
    assert budget.used[0] == pytest.approx(1.0)  # at the rated torque it stays
    told[0] = 0.0
    budget.take(3000)  # losses of 100 less, of 300 above the rated ones: half
    assert budget.used[0] == pytest.approx(0.5)
    budget.take(9000)
    assert budget.used[0] == 0.0


def test_whoever_gives_all_comes_down_to_what_lasts_smoothly_and_never_uses_more_than_the_share() -> None:
    budget, told = heat()
    able = []
    for _ in range(4000):
        told[0] = budget.able[0]
        budget.take(1)
        able.append(float(budget.able[0]))
    at_peak = able.index(next(a for a in able if a < 20.0)) * DT
    assert at_peak == pytest.approx(0.7 * PLANNED * 2.0, abs=2 * DT)
    tau = 0.3 * PLANNED * 2.0  # of the squared torque above the rated one
    t = np.arange(1, 4001) * DT - at_peak - DT
    expected = np.sqrt(100.0 + 300.0 * np.exp(-np.maximum(t, 0.0) / tau))
    np.testing.assert_allclose(able, expected, atol=0.02)
    assert np.abs(np.diff(able)).max() < 20.0 * DT / tau
    assert PLANNED - 0.01 < budget.used[0] <= PLANNED


@pytest.mark.parametrize("seed", range(3))
def test_no_way_within_what_is_able_passes_the_share_whatever_the_lasting_torque_is(seed: int) -> None:
    random = np.random.default_rng(seed)
    lasting = float(random.uniform(2.0, 10.0))
    budget, told = heat(lasting)
    integral = worst = 0.0
    for _ in range(6000):
        told[0] = budget.able[0] * random.choice([-1.0, 1.0]) * random.uniform(0.5, 1.0) ** 0.1
        integral = max(0.0, integral + (told[0] ** 2 - 100.0) * DT / (300.0 * 2.0))
        worst = max(worst, integral)
        budget.take(1)
        assert lasting <= budget.able[0] <= 20.0
    assert budget.used[0] == pytest.approx(integral)
    assert worst <= PLANNED


def test_a_motor_without_a_peak_keeps_its_torque_to_the_last_bit() -> None:
    budget, told = heat(0.1 + 0.2, None)
    told[0] = 50.0
    budget.take(1000)
    assert budget.able[0] == 0.1 + 0.2
    assert budget.used[0] == 0.0


JOINT = AxisLimits("joint_1", 10.0, inf, inf, -1.0, 1.0, PEAK)
FIRM = AxisLimits("joint_2", 10.0, inf, inf, -1.0, 1.0)


class Watched:
    """A gate for two joints, asked once a tick."""

    def __init__(self) -> None:
        self.gate = Gate([JOINT, FIRM], 1.0 / DT, [np.zeros(2)])
        self.tick = 0

    def admit(self, *commands: float, skipped: int = 0, armed: bool = True) -> Reaction:
        self.tick += 1 + skipped
        still = [0.0, 0.0]
        return self.gate.admit(
            *(commands, still, still, armed, self.tick, self.tick, [False, False])
        ).reaction


def test_the_gate_admits_a_peak_to_the_motor_that_has_one_and_no_longer_than_its_time() -> None:
    asked = Watched()
    assert asked.admit(20.0, 10.0) is Reaction.PASS
    assert asked.admit(20.0, 10.1) is Reaction.SANITISE
    assert asked.gate.admitted.tolist() == [20.0, 10.0]
    assert asked.admit(20.1, 10.0) is Reaction.SANITISE
    given = []
    for _ in range(7000):
        asked.admit(20.0, 0.0)
        given.append(asked.gate.admitted[0])
    used = np.cumsum(np.square(given) - 100.0) * DT / 600.0
    assert ADMITTED - 0.01 < used[-1] < 1.0  # the drive, which folds back at 1, never has to
    assert given[-1] == pytest.approx(10.0, abs=0.1)


def test_a_controller_that_plans_with_its_share_is_never_clamped() -> None:
    asked, (budget, told) = Watched(), heat()
    for _ in range(6000):
        told[0] = asked.gate.admitted[0]
        budget.take(1)
        assert asked.admit(float(budget.able[0]), 0.0) is Reaction.PASS
    assert asked.gate.admitted[0] < 10.1


def test_ticks_that_were_skipped_held_the_last_command_and_a_disarmed_motor_cools() -> None:
    asked = Watched()
    asked.admit(20.0, 0.0)
    asked.admit(20.0, 0.0, skipped=1899)
    assert asked.gate.admitted[0] == pytest.approx(10.0)  # 1.9 s of 2 are gone
    asked.admit(0.0, 0.0, armed=False)
    asked.admit(20.0, 0.0, skipped=5999)
    assert asked.gate.admitted[0] == 20.0


def test_a_peak_leaves_the_power_as_it_is() -> None:
    gate = Gate([AxisLimits("joint_1", 10.0, inf, 40.0, -1.0, 1.0, PEAK)], 1.0 / DT, [np.zeros(1)])
    gate.admit([20.0], [0.0], [4.0], True, 1, 1, [False])
    assert gate.admitted.tolist() == [10.0]
