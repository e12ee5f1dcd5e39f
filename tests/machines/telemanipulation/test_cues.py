"""Whatever keeps the avatar from following is felt by the operator's hand, as what it is."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.control.cue import AVATAR_LIMIT, ENERGY, LIMIT, MOST, QUIET, RHYTHMS, STOPPED, UNLED, pattern
from hapticd.machines.operator.figures import OperatorFigures
from hapticd.runtime.core.modes import Mode
from hapticd.sim.network_model import Conditions
from hapticd.testing.copies import in_a_copy

from .pairs import Both, following


@pytest.fixture(name="pair")
def follows() -> Both:
    """An avatar that follows; each test moves a copy of it."""
    return following()


def cut(pair: Both) -> None:
    pair.network.there._conditions = pair.network.back._conditions = Conditions(outages=[(0.0, 1e9)])


def felt(pair: Both, seconds: float) -> np.ndarray:
    """Spectrum of the force of the left hand on its palm along the axis of cues, up to 200 Hz in 1 Hz."""
    arm, row = pair.leads.arms[0].arm, []
    for _ in range(round(seconds / pair.dt)):
        pair.go(pair.dt)
        row.append(float(arm.hold.wrench[:3] @ arm.rotation[:, 0]))
    force = np.array(row)
    return np.abs(np.fft.rfft((force - force.mean()) * np.hanning(len(force)), round(1.0 / pair.dt)))[:200]


def logged(pair: Both) -> np.void:
    """What the log would keep of this tick."""
    station = pair.machines[0]
    state = np.zeros(1, station.state)
    station.bind_state(state)
    station.fill()
    return state[0]


def causes(pair: Both) -> list[int]:
    return [int(cause) for cause in logged(pair)["cause"]]


@in_a_copy
def test_each_cause_is_felt_at_the_handle_at_its_own_frequency(pair: Both) -> None:
    station = pair.machines[0]
    quiet = felt(pair, 0.45)
    for cause, rhythm in RHYTHMS.items():
        station._intervenes = lambda i, cause=cause: (cause, 100.0) if i == 0 else (QUIET, 0.0)
        loud = felt(pair, len(pattern(rhythm, pair.dt)) * pair.dt)
        frequency = 15 + int(loud[15:].argmax())
        assert frequency == pytest.approx(rhythm.frequency, rel=0.1)
        assert loud[frequency] > 5.0 * quiet[frequency]
    assert station._cues[0].level > 0.8 * MOST and station._cues[1].force == 0.0
    assert pair.operator.mode is Mode.ACTIVE, pair.said


@in_a_copy
def test_each_number_of_the_log_is_that_of_its_own_arm(pair: Both) -> None:
    pair.go(0.05)
    station, state = pair.machines[0], logged(pair)
    for i, arm in enumerate(station.arms):
        law = station._laws[i]
        of = {
            **{"q": arm.task.q, "position": arm.task.palm.position, "goal": station._clutches[i].position},
            **{"hand": arm.force.wrench, "felt": station._felt_there[i], "alpha": arm.avoidance.alpha},
            **{"own_limits": arm.avoidance.torque, "avatar_limits": law.avatar, "torque": law.torque},
        }
        for name, values in of.items():
            assert state[name][i].tolist() == values.tolist(), name
    assert (state["position"][0] != state["position"][1]).any()


@in_a_copy
def test_a_silent_link_is_felt_until_it_is_back_and_nothing_is_felt_before(pair: Both) -> None:
    assert causes(pair) == [QUIET] * 2 and not any(cue.force for cue in pair.machines[0]._cues)
    cut(pair)
    pair.go(0.03)
    assert causes(pair) == [UNLED] * 2
    state = logged(pair)
    assert all("does not follow" in row for row in OperatorFigures().live(Mode.ACTIVE, state))
    pair.go(0.05)
    assert np.abs([cue.force for cue in pair.machines[0]._cues]).max() > 0.1
    assert logged(pair)["announced"].tolist() == [UNLED] * 2
    pair.network.there._conditions = pair.network.back._conditions = Conditions()
    pair.go(0.5)
    assert causes(pair) == [QUIET] * 2 and not any(cue.force for cue in pair.machines[0]._cues)


@in_a_copy
def test_an_arm_that_stopped_itself_over_there_is_felt_in_its_hand_only(pair: Both) -> None:
    avatar = pair.machines[1]
    avatar.arms[0]._most = 5.0, 1.0  # a light touch is too much
    pair.wall_ahead(3000.0, 0.005)
    for i in range(2):
        pair.reach(i, [0.05, 0.0, 0.0])
    pair.go(0.8)
    assert avatar.arms[0].stopped and causes(pair)[0] == STOPPED != causes(pair)[1]


@in_a_copy
def test_limits_here_and_there_and_the_links_energy_are_causes(pair: Both) -> None:
    seen, most = set[int](), 0.0
    station = pair.machines[0]
    station.far[0].behind = True
    assert station._intervenes(0)[0] == ENERGY and station._intervenes(1)[0] == QUIET
    for i in range(2):
        pair.reach(i, [0.45, 0.0, 0.0])  # further than the arms reach
    for _ in range(6):
        pair.go(0.2)
        seen |= set(causes(pair))
        most = max(most, *logged(pair)["amount"].tolist())
    assert seen & {LIMIT, AVATAR_LIMIT} and most > 1.0, pair.said
