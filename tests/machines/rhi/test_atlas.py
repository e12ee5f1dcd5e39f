"""Postures that can go on following the hand, all over its reach, and ways to them that keep the limits."""

from collections import Counter
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.experiments import hands
from hapticd.machines.rhi.atlas import Atlas, _room_to_follow, atlas_of
from hapticd.machines.rhi.guard import Span
from hapticd.machines.rhi.once import Once
from hapticd.machines.rhi.reachable import AHEAD, Parts, Way
from hapticd.machines.rhi.redundant import RedundantArm
from hapticd.machines.rhi.self_motion import close, scan
from hapticd.models import Array
from hapticd.runtime.configuration.config import Loaded, load, parse
from hapticd.runtime.configuration.session import build
from hapticd.runtime.live.lockstep import Lockstep

from .rhi_device import four_dof
from .test_guard import SPAN
from .test_reachable import elbow_arm

ELBOW = (np.array([-3.0, -2.8, -3.0]), np.array([3.0, 2.8, 3.0]))


def test_a_way_leads_round_what_a_straight_pull_is_caught_by() -> None:
    """From elbow to elbow where only a stretched arm joins them, if the last link points the right way."""
    arm, far = elbow_arm(), np.array([0.5, 0.0])
    parts = Parts(arm, far, ELBOW, 3000)
    begin, end = (parts.postures[np.argmin(parts.postures[:, 1] * side)] for side in (1.0, -1.0))
    way, q, lefts = Way(parts, end), begin, []
    for _ in range(100):
        left, ahead = way.go_on(q)
        lefts.append(left)
        if left <= AHEAD:
            break
        q = ahead
        assert np.linalg.norm(arm.reach(q[None])[0][0] - far) < 1e-6
        assert (ELBOW[0] <= q).all() and (q <= ELBOW[1]).all()
    assert lefts == sorted(lefts, reverse=True) and lefts[0] > AHEAD >= lefts[-1]


def test_where_no_way_leads_it_is_said() -> None:
    arm, near = elbow_arm(), np.array([0.3, 0.1])
    parts = Parts(arm, near, ELBOW, 3000)
    left, right = (parts.postures[np.argmin(parts.postures[:, 1] * side)] for side in (1.0, -1.0))
    assert np.isinf(Way(parts, right).go_on(left)[0]) and Way(parts, left).go_on(left)[0] == 0.0


def test_room_to_follow_is_how_far_the_hand_goes_until_the_first_motor_is_at_its_limit() -> None:
    """Against small steps of the hand in 64 directions."""
    arm = four_dof()
    lower, upper = SPAN.inside(0.0)
    x, step = np.array([0.45, 0.1]), 1e-4
    postures = scan(arm, x, (lower, upper), 60)
    angles = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    for q, room in zip(postures, _room_to_follow(arm, postures, SPAN), strict=True):
        ways = step * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        moved = close(arm, np.repeat(q[None], 64, axis=0), x + ways) - q
        until = np.minimum(upper - q, q - lower) / np.maximum(np.abs(moved), 1e-12)
        assert room == pytest.approx(step * until.min(), rel=0.01)


def kept_inside(atlas: Atlas, arm: RedundantArm, q: Array, way: Array) -> bool:
    """Whether a posture that turns as the atlas says follows the hand to the end of a way, (k, m)."""
    lower, upper = SPAN.inside(0.0)
    for x in way:
        for _ in range(5):
            ahead = atlas.ahead(x, q)
            goal = q if ahead is None else ahead
            tried = np.clip(q + np.clip(goal - q, -0.02, 0.02), lower, upper)
            closed = close(arm, np.stack([tried, q]), x)
            good = np.all((lower <= closed) & (closed <= upper), axis=1)
            good &= np.linalg.norm(arm.reach(closed)[0] - x, axis=1) < 1e-6
            if not good.any():
                return False
            q = closed[np.argmax(good)]
    return True


def test_postures_that_turn_as_it_says_follow_random_hands_farther_than_those_that_only_follow() -> None:
    arm, rng = four_dof(), np.random.default_rng(7)
    atlas = Atlas(arm, SPAN)
    nothing = copy(atlas)
    nothing._pages = {}
    lower, upper = SPAN.inside(0.3)
    turning = following = 0
    for _ in range(60):
        q, goal = rng.uniform(lower, upper, (2, 4))
        (begin, end), _J = arm.reach(np.stack([q, goal]))
        steps = max(2, int(np.linalg.norm(end - begin) / 0.005))
        way = begin + np.linspace(0.0, 1.0, steps)[:, None] * (end - begin)
        turning += kept_inside(atlas, arm, q, way)
        following += kept_inside(nothing, arm, q, way)
    assert turning > following + 10


def test_an_atlas_is_drawn_once_for_what_reaches_the_same_within_the_same_limits() -> None:
    arm = four_dof()
    first = atlas_of(arm, SPAN)
    assert atlas_of(four_dof(), replace(SPAN, fastest=(1.0,) * 4)) is first
    closer, tighter = replace(SPAN, margin=1.1 * SPAN.margin), replace(SPAN, upper=(1.5, *SPAN.upper[1:]))
    others = {id(atlas_of(arm, span)) for span in (closer, tighter)}
    assert len({id(atlas_of(elbow_arm(), Span((-3.0,) * 3, (3.0,) * 3, 0.1))), id(first)} | others) == 4
    x, q = np.array([0.4, 0.1]), np.array([0.5, 0.4, 0.3, 0.2])
    assert first.ahead(x, q).tolist() == Atlas(arm, SPAN).ahead(x, q).tolist()


def test_of_what_is_drawn_once_the_last_asked_for_are_kept() -> None:
    kept, made = Once[list[str]](2), Counter[str]()

    def ask(what: str) -> list[str]:
        def draw() -> list[str]:
            made[what] += 1
            return [what]

        return kept.get(elbow_arm(), Span((-3.0,) * 3, (3.0,) * 3, 0.1), (what,), draw)

    assert [ask(what) for what in "ababcba"] == [[what] for what in "ababcba"]
    assert made == {"a": 2, "b": 1, "c": 1}


LED = """
[[simulation.hand.path]]
at = "{at} s"
position = "{x} {y} 0 m"
"""
AWAY = [
    (0.0, 0.6667, -0.1428),
    (3.3, 0.6667, -0.1428),
    (4.8, 0.5669, -0.1785),
    (5.6, 0.5669, -0.1785),
    (7.5, 0.4384, -0.1744),
    (8.3, 0.4384, -0.1744),
    (9.6, 0.3461, -0.1715),
]


def led_away() -> Loaded:
    """A weak hand that leads the handle 32 cm away from a wall, and that begins in a posture from which a
    straight pull to the targets ends in a corner of the limits."""
    text = read_text("rhi.toml").partition("[[simulation.hand.path]]")[0]
    for old, new in (
        ('point = "0.5 0.1 m"', 'point = "0.6978 -0.1546 m"'),
        ("normal = [0, 1]", "normal = [0.935, -0.355]"),
        ('home = "0 0 0 0 rad"', 'home = "0.7969 -0.3823 1.1592 1.1870 rad"'),
        ("1.024066 -0.156786 0.230091 1.655231", "0.056155 0.199223 -0.402033 1.501694"),
        ('force = "40 N"', 'force = "9 N"'),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    before, _, rest = text.partition("[simulation.touches]")
    text = before + "[simulation.hand]" + rest.partition("[simulation.hand]")[2]
    text += "".join(LED.format(at=at, x=x, y=y) for at, x, y in AWAY)
    return replace(load("rhi"), text=text, config=parse(text, "rhi.toml"))


@pytest.mark.parametrize("broken", [False, True], ids=["as it is", "pulled straight"])
def test_a_weak_hand_that_leads_the_handle_far_away_meets_no_limit(
    broken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if broken:  # what the ways are for
        monkeypatch.setattr(Way, "go_on", lambda way, q: (0.0, q))
        monkeypatch.setattr(Atlas, "ahead", lambda atlas, x, q: None)
    kept = hands._session(Lockstep(build(led_away())), 1, 10.0, lambda lockstep: None)
    assert (kept.stop == "overloaded") == broken
    assert broken or kept.seconds == 10.0
