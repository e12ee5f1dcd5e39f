"""Both stations together: the avatar follows, holds, fades in; the operator feels what it feels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hapticd.control.lease import Standing
from hapticd.machines.telemanipulation.pair import Pair, PairError
from hapticd.machines.telemanipulation.pair_run import pair_run
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay
from hapticd.sim.hand import Grip
from hapticd.sim.network_model import Conditions, NetworkModel
from hapticd.sim.wall import Walls
from hapticd.testing.copies import in_a_copy

from .pairs import Both, both, following


@pytest.fixture(name="pair")
def follows() -> Both:
    """An avatar that follows; each test moves a copy of it."""
    return following()


def cut(pair: Both) -> None:
    """The link is silent from now on."""
    pair.network.there._conditions = pair.network.back._conditions = Conditions(outages=[(0.0, 1e9)])


def mend(pair: Both) -> None:
    pair.network.there._conditions = pair.network.back._conditions = Conditions()


def standings(pair: Both) -> list[Standing]:
    return [lease.standing for machine in pair.machines for lease in machine.leases]


@in_a_copy
def test_the_avatar_follows_and_nothing_stopped(pair: Both) -> None:
    assert standings(pair) == [Standing.FOLLOWS] * 4
    for i in range(2):
        pair.reach(i, [0.06, 0.02, -0.04])
    pair.go(1.5)
    for i in range(2):
        lead, follow = pair.palms(i)
        assert np.linalg.norm(lead - follow) < 8e-3
    assert pair.operator.mode is pair.avatar.mode is Mode.ACTIVE, pair.said


@in_a_copy
def test_without_a_link_the_avatar_holds_its_pose_and_the_wrench_is_gone_in_50_ms(pair: Both) -> None:
    pair.wall_ahead(3000.0, 0.01)
    pair.reach(0, [0.06, 0.0, 0.0])
    pair.reach(1, [-0.03, 0.0, 0.0])
    pair.go(1.0)
    law = pair.machines[0]
    assert np.linalg.norm(law._felt_there[0]) > 5.0
    cut(pair)
    pair.go(0.025)
    places = [pair.palms(i)[1] for i in range(2)]
    assert standings(pair) == [Standing.WAITS] * 4
    pair.go(0.05)
    assert not law._felt_there.any()
    for i in range(2):
        pair.reach(i, [-0.2, 0.1, 0.0])
    pair.go(2.1)
    assert standings(pair) == [Standing.ENDED] * 4
    assert all(np.linalg.norm(pair.palms(i)[1] - places[i]) < 1e-3 for i in range(2)), "in contact, too"
    assert pair.avatar.mode is Mode.ACTIVE, "it holds under power"
    mend(pair)
    pair.go(0.5)
    assert standings(pair) == [Standing.ENDED] * 4, "a new act is needed"
    assert any("left arm holds: the link was silent for too long" in said for said in pair.said)


@in_a_copy
def test_a_link_that_comes_back_to_another_place_pulls_at_nothing(pair: Both) -> None:
    law = pair.machines[1]._laws[0]
    law.commanded[:] = law.goal + np.array([0.0, 0.0, 0.2])
    law.reset()
    law._core.share = 1.0  # what it would do without the fade
    law.update(True)
    hard = np.abs(law.wrench[:3]).max()
    law.reset()
    law.update(True)
    assert hard > 60.0
    assert np.abs(law.wrench[:3]).max() < 0.02 * hard


@in_a_copy
def test_reconnected_the_palms_meet_within_the_fade_without_a_pull(pair: Both) -> None:
    cut(pair)
    pair.go(0.03)
    for i in range(2):
        pair.reach(i, [0.0, 0.0, 0.1])
    pair.go(1.2)
    mend(pair)
    pair.go(0.002)
    apart = [np.linalg.norm(np.subtract(*pair.palms(i))) for i in range(2)]
    assert min(apart) > 0.08
    most = 0.0
    for _ in range(32):
        pair.go(0.1)
        most = max(most, *(float(np.linalg.norm(law.wrench[:3])) for law in pair.machines[1]._laws))
    assert most < 12.0, "600 N/m at 100 mm would be 60 N"
    assert all(np.linalg.norm(np.subtract(*pair.palms(i))) < 8e-3 for i in range(2))


@in_a_copy
def test_in_steady_contact_the_operator_feels_at_least_half_of_the_avatars_force(pair: Both) -> None:
    pair.wall_ahead(3000.0, 0.01)
    for i in range(2):
        pair.reach(i, [0.07, 0.0, 0.0])
    pair.go(1.5)
    for i in range(2):
        hand, wall = pair.forces(i)
        assert wall > 8.0 and hand > 0.5 * wall, f"{hand:.1f} N of {wall:.1f} N"


@in_a_copy
def test_walls_are_felt_and_stable_over_a_bad_network(pair: Both) -> None:
    network = Conditions(0.12, 0.04, 0.05, 2.0)
    pair.network.there._conditions = pair.network.back._conditions = network
    for machine in pair.machines:
        for lease in machine.leases:
            lease._delay = network.longest
    pair.go(0.4)
    pair.wall_ahead(10000.0)
    for i in range(2):
        pair.reach(i, [0.07, 0.0, 0.0])
    pair.go(2.0)
    places, forces = [], []
    for _ in range(20):
        pair.go(0.02)
        places.append([pair.palms(i)[0][0] for i in range(2)])
        forces.append([pair.forces(i) for i in range(2)])
    assert standings(pair) == [Standing.FOLLOWS] * 4
    assert np.ptp(places, axis=0).max() < 3e-3
    hand, wall = np.mean(forces, axis=0).T
    assert (wall > 2.0).all() and (hand > 0.5 * wall).all() and np.max(forces) < 30.0


@in_a_copy
@pytest.mark.parametrize("layer", [True, False])
def test_a_round_trip_of_700_ms_throws_a_loose_hand_back_without_the_layer_only(
    pair: Both, layer: bool
) -> None:
    pair.network.there._conditions = pair.network.back._conditions = Conditions(0.35)
    for hand, machine in zip(pair.leads.hands, pair.machines, strict=True):
        hand._grip = Grip((250.0, 20.0), (10.0, 0.8), (40.0, 4.0))
        machine._passive = layer
        for far in getattr(machine, "far", ()):
            far.passive = layer
        for lease in machine.leases:
            lease._delay = 0.35
    pair.go(0.8)
    pair.wall_ahead(10000.0)
    for i in range(2):
        pair.reach(i, [0.08, 0.0, 0.0])
    pair.go(1.5)
    most = 0.0
    for _ in range(30):
        pair.go(0.1)
        most = max(most, *(force for i in range(2) for force in pair.forces(i)))
    assert (most < 20.0) == layer, f"{most:.1f} N"


@in_a_copy
def test_a_blow_stops_one_arm_the_operator_is_told_and_an_act_there_starts_it_again(pair: Both) -> None:
    avatar = pair.machines[1]
    avatar.arms[0]._most = 5.0, 1.0  # a light touch is too much
    pair.wall_ahead(3000.0, 0.005)
    for i in range(2):
        pair.reach(i, [0.05, 0.0, 0.0])
    pair.go(0.8)
    assert avatar.arms[0].stopped and not avatar.arms[1].stopped
    assert [lease.standing for lease in avatar.leases] == [Standing.BARRED, Standing.FOLLOWS]
    assert any("press the left button" in said for said in pair.said)
    pair.follows.walls = Walls([])
    avatar.arms[0]._most = 60.0, 15.0
    buttons = pair.leads._buttons
    now = pair.leads.time
    buttons._presses = [(1, now, now + 0.05)]
    pair.go(0.3)
    assert not avatar.arms[0].stopped and avatar.leases[0].follows
    assert 0.0 < avatar._laws[0].share < 0.2, "it fades in"


@in_a_copy
def test_an_operator_who_lets_go_leaves_the_avatar_holding(pair: Both) -> None:
    pair.leads._plc.dead_man = (False, False)
    pair.go(0.1)
    places = [pair.palms(i)[1] for i in range(2)]
    pair.go(0.5)
    assert pair.operator.mode is Mode.STOPPED and pair.avatar.mode is Mode.ACTIVE
    assert [lease.standing for lease in pair.machines[1].leases] == [Standing.RESTS] * 2
    assert all(np.linalg.norm(pair.palms(i)[1] - places[i]) < 1e-3 for i in range(2))


@in_a_copy
def test_a_clutched_arm_moves_alone_and_goes_on_without_a_jump(pair: Both) -> None:
    now = pair.leads.time
    pair.leads._buttons._presses = [(2, now + 0.01, now + 1.0)]
    pair.go(0.02)
    before = pair.palms(1)[1]
    pair.reach(1, [0.0, -0.05, 0.05])
    pair.go(1.2)
    lead, follow = pair.palms(1)
    assert np.linalg.norm(lead - before) > 0.04
    assert np.linalg.norm(follow - before) < 5e-3
    pair.reach(1, [0.04, 0.0, 0.0])
    pair.go(1.0)
    assert pair.palms(1)[1][0] - follow[0] == pytest.approx(0.04, abs=8e-3)


def test_the_same_seed_is_the_same_pair_and_each_replays_alone(tmp_path: Path) -> None:
    conditions = Conditions(0.004, 0.003, 0.02)
    logs = []
    for name in ("first", "again"):
        pair = both(conditions, 7)
        stations = [each.session.loaded for each in (pair.operator, pair.avatar)]
        logs.append([tmp_path / f"{name}-{station}.mcap" for station in ("operator", "avatar")])
        outcomes, _ = pair_run(pair, stations, logs[-1], 0.8, False)
        assert [outcome.status for outcome in outcomes] == [0, 0]
        for outcome in outcomes:
            (apart,) = [figure.max for figure in outcome.report.figures if figure.name == "palm to goal"]
            assert apart < 100.0
    for here, there in zip(*logs, strict=True):
        assert here.read_bytes() == there.read_bytes()
    for log in logs[0]:
        found = replay(open_log(str(log)))
        assert found.ticks > 800 and found.differing_ticks == 0


def test_what_is_no_pair_is_refused() -> None:
    network = NetworkModel(Conditions(), 1)
    with pytest.raises(PairError, match="no station"):
        Pair(config.load("operator"), config.load("rhi"), network)
    for first, second in (("operator", "operator"), ("avatar", "avatar"), ("avatar", "operator")):
        with pytest.raises(PairError, match="name"):
            Pair(config.load(first), config.load(second), network)


@pytest.mark.parametrize("seed", [3, 5])
def test_hands_that_go_further_than_the_arms_reach_take_no_joint_beyond_its_limits(
    pair: Both, seed: int
) -> None:
    in_a_copy(lead_too_far)(pair, seed)


def lead_too_far(pair: Both, seed: int) -> None:
    random = np.random.default_rng(seed)
    for i in range(2):
        way = random.normal(size=3)
        pair.reach(i, (0.7 * way / np.linalg.norm(way)).tolist())
    for _ in range(25):
        pair.go(0.1)
        for machine in pair.machines:
            for arm in machine.arms:
                low, high = np.array(arm.chain.lower), np.array(arm.chain.upper)
                assert ((low <= arm.task.q) & (arm.task.q <= high)).all(), arm.task.q
    assert pair.operator.mode is pair.avatar.mode is Mode.ACTIVE, pair.said
    assert not any(arm.stopped for machine in pair.machines for arm in machine.arms)
