"""Neck and base in the stations: they follow head and foot within limits, and stop where nobody leads."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.runtime.core.modes import Mode
from hapticd.safety import Reaction, Verdict
from hapticd.sim.base_drive import SimBaseDrive
from hapticd.sim.neck_arm import SimNeckArm
from hapticd.sim.network_model import Conditions
from hapticd.testing.copies import in_a_copy

from .pairs import Both, following


class Fixed:
    """A head, or a foot, from now on."""

    def __init__(self, *numbers: float) -> None:
        self._numbers = list(numbers)

    def at(self, time: float) -> list[float]:
        return self._numbers


@pytest.fixture(name="pair")
def follows() -> Both:
    return following()


def parts(pair: Both) -> tuple[SimNeckArm, SimBaseDrive]:
    (neck,), (base,) = (pair.follows.nodes.of(kind) for kind in (SimNeckArm, SimBaseDrive))
    return neck, base


def moving(pair: Both) -> None:
    """The head leans to the left and forward, the foot pushes forward."""
    pair.leads._nodding = Fixed(0.05, 0.04, 1.2, 0.0, 0.2, 0.3)
    pair.leads._treading = Fixed(0.6, 0.0, 0.0)
    pair.go(0.7)


@in_a_copy
def test_the_neck_goes_where_the_head_went_and_the_base_where_the_foot_pushes(pair: Both) -> None:
    moving(pair)
    neck, base = parts(pair)
    np.testing.assert_allclose(neck.way, [0.05, 0.04, 0.0, 0.0, 0.2, 0.3], atol=4e-3)
    assert base.speed[0] == pytest.approx(0.5 * (0.6 - 0.15) / 0.85, rel=0.05) and abs(base.speed[1]) < 1e-6
    assert base.place[0] > 0.05
    assert pair.machines[0].body._remote.speed[0, 0] == pytest.approx(base.speed[0], abs=0.02)
    assert pair.avatar.session.cycle.set_points.clamps == 0


@in_a_copy
def test_no_head_and_no_foot_leads_them_beyond_their_limits(pair: Both) -> None:
    pair.leads._nodding = Fixed(0.16, 0.13, 1.31, 0.5, 0.5, 0.6)
    pair.leads._treading = Fixed(1.0, -1.0, 1.0)
    machine = pair.machines[1]
    before, most = machine.wanted[-9:].copy(), np.zeros(9)
    for _ in range(1100):
        pair.go(1e-3)
        most = np.maximum(most, np.abs(machine.wanted[-9:] - before))
        before = machine.wanted[-9:].copy()
    step = 4e-3
    assert (most[:6] <= np.repeat([0.6, 2.5], 3) * step + 1e-12).all() and most[:6].any()
    assert np.hypot(*most[6:8]) <= 0.5 * step * 1.01 and most[8] <= step * 1.0 + 1e-12
    assert np.hypot(*before[6:8]) == pytest.approx(0.5) and before[8] == pytest.approx(0.6)
    assert (np.abs(before[:6]) <= [0.15, 0.12, 0.1, 0.5, 0.7, 1.2]).all()
    assert pair.avatar.session.cycle.set_points.clamps == 0 and pair.avatar.mode is Mode.ACTIVE


@in_a_copy
def test_without_a_link_the_neck_holds_and_the_base_comes_to_rest(pair: Both) -> None:
    moving(pair)
    neck, base = parts(pair)
    pair.network.there._conditions = pair.network.back._conditions = Conditions(outages=[(0.0, 1e9)])
    pair.go(0.05)
    before = np.array(neck.way)
    pair.go(0.9)
    assert np.abs(base.speed).max() < 1e-3
    np.testing.assert_allclose(neck.way, before, atol=5e-3)
    pair.network.there._conditions = pair.network.back._conditions = Conditions()
    pair.go(0.5)
    assert np.abs(base.speed).max() < 1e-3, "a foot that was on the paddle all the time moves nothing"
    pair.leads._nodding = Fixed(0.03, 0.04, 1.2, 0.0, 0.2, 0.3)
    pair.go(0.5)
    assert neck.way[0] == pytest.approx(0.03, abs=3e-3), "the middle is the one that it was"


@in_a_copy
@pytest.mark.parametrize("reaction", [Reaction.HOLD, Reaction.RAMP, Reaction.OFF])
def test_in_every_stop_the_base_comes_to_rest(pair: Both, reaction: Reaction) -> None:
    moving(pair)
    neck, base = parts(pair)
    cycle = pair.avatar.session.cycle
    cycle.stops.take(Verdict(reaction, "operator", "a test"), cycle.counter)
    pair.go(0.9)
    assert np.abs(base.speed).max() < 1e-3
    assert neck.enabled == base.enabled == (reaction is Reaction.HOLD)


@in_a_copy
def test_an_arm_that_stopped_itself_stops_the_base(pair: Both) -> None:
    moving(pair)
    _, base = parts(pair)
    pair.machines[1].arms[0].stopped = "a blow"
    pair.go(0.9)
    assert np.abs(base.speed).max() < 1e-3


@in_a_copy
def test_a_tracker_that_is_lost_leads_nobody_and_spoils_nothing_else(pair: Both) -> None:
    moving(pair)
    _, base = parts(pair)
    (tracker,) = pair.leads._trackers
    tracker.see = lambda *pose: tracker.fields["pose"].fill(np.nan)
    pair.go(0.9)
    assert np.abs(base.speed).max() < 1e-3
    assert [lease.follows for lease in pair.machines[1].leases] == [True, True]
    assert pair.avatar.mode is Mode.ACTIVE
