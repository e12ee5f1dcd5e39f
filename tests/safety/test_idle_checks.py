"""A monitor asks in a calm tick what may have something to say: the others would say and change nothing."""

from dataclasses import asdict
from math import inf, nan

import numpy as np
import pytest
from hapticd.safety import Monitor, Observation, Reaction
from hapticd.safety.tally import Rule, Tallies, Tally

from .test_monitor import THRESHOLDS, good

CALM: dict[str, object] = {
    **dict.fromkeys(("missed", "faults", "lost"), ()),
    **dict.fromkeys(("rejected", "mismatched", "unbalanced", "frozen", "contradicted", "stale"), ()),
}
ODD: dict[str, list[object]] = {
    "skipped": [1, 3, 25, 10**9],
    "missed": [[0, 1, 0], [6, 0, 0], [0, 0, 30], [0, 0, 0]],
    "discarded": [1],
    "foreign": [2],
    "faults": [[0, 0x8130, 0], [0, 0, 0]],
    "lost": [[True, False, False], [False] * 3],
    "rejected": [[False, True], [False, False]],
    "mismatched": [[True, False]],
    "unbalanced": [[True, True]],
    "frozen": [[True, False]],
    "contradicted": [[False, True]],
    "stale": [[True, False], [True, True], [False, False]],
    "astray": [[False, True], [False, False]],
    "overload": ["joint_1"],
    "ahead": ["a link would have met the floor"],
    "pressed": ["a link is pushed towards the floor"],
    "position": [[0.0, 1.7], [nan, 0.0], [0.0, -1.6], [inf, 0.0]],
    "velocity": [[-3.7, 0.0], [3.6, 1.3], [0.0, nan]],
    "way": [[2.8, 0.0], [nan, 0.0]],
    "armed": [False],
    "dead_man": [False],
    "e_stop": [True],
    "field_clear": [False],
    "supervised": [False],
    "overriding": [True],
    "guarded": [True],
    "sto": [True],
    "wrench": [None, [nan, *[0.0] * 5], [0.0] * 5 + [-inf]],
    "inertial": [False],
    "solved": [False],
}


def test_every_field_can_be_odd() -> None:
    assert ODD.keys() == asdict(Observation()).keys()


@pytest.mark.parametrize("seed", range(6))
def test_a_monitor_says_what_one_says_that_asks_every_check_in_every_tick(seed: int) -> None:
    rng = np.random.default_rng(seed)
    monitor, asked = Monitor(THRESHOLDS), Monitor(THRESHOLDS)
    reactions, spared = set[Reaction](), 0
    for _ in range(400):
        few = rng.choice(list(ODD), rng.integers(1, 4), replace=False)
        for _ in range(rng.integers(1, 12)):
            odd = {name: ODD[name][rng.integers(len(ODD[name]))] for name in few if rng.random() < 0.7}
            _same(monitor, asked, good(**{**CALM, **odd}), reactions)
        for _ in range(rng.choice([0, 1, 99, 100, 101, 130])):
            spared += monitor._idle
            _same(monitor, asked, good(**CALM), reactions)
    assert reactions == set(Reaction) and spared > 1000


def _same(monitor: Monitor, asked: Monitor, seen: Observation, reactions: set[Reaction]) -> None:
    asked._idle = False
    verdict = monitor.judge(seen)
    assert (verdict, monitor.trust) == (asked.judge(seen), asked.trust)
    reactions.add(verdict.reaction)


@pytest.mark.parametrize("field", [name for name in ODD if name not in ("armed", "stale", "overload")])
def test_nothing_that_comes_in_a_calm_tick_is_overlooked(field: str) -> None:
    """Of an idle monitor, as of one that asks every check."""
    for odd in ODD[field]:
        monitor, asked = Monitor(THRESHOLDS), Monitor(THRESHOLDS)
        monitor.judge(good(**CALM))
        assert monitor._idle
        _same(monitor, asked, good(**{**CALM, field: odd}), set())


@pytest.mark.parametrize("seed", range(3))
def test_idle_counters_are_those_that_a_good_tick_does_not_change(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rules = Rule(Reaction.SANITISE, 1, 1), Rule(Reaction.RAMP, 4, 30)
    tally, tallies, last = Tally(*rules), Tallies(("a", "b"), *rules), -1000
    for k in range(3000):
        bad = bool(rng.random() < 0.03)
        last = k if bad else last
        tally.push(bad)
        tallies.push([bad, False] if rng.random() < 0.5 or bad else ())
        assert tally.idle == tallies.idle == (k - last >= 30)
        if tally.idle:
            assert (tally.push(False), tallies.push(())) == (Reaction.PASS, (Reaction.PASS, [], ""))
    tally.push(True)
    assert not tally.idle
    tally.clear()
    assert tally.idle
